"""Motions and small oscillations: inertia, time integration, modes."""
