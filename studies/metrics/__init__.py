"""Numbers read off a run."""
