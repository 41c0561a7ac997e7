"""Charts of many runs at once: what breaks, what recovers, where steps are stable, other programs, populations."""
