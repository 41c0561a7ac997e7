"""Which nodes touch, and what that takes from their motion."""
