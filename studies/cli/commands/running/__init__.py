"""Commands that run cases, and tell what a run will cost."""
