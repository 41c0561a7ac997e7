"""The reference against known answers and other codes."""
