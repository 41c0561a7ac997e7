"""What is built once before a run, so that a step finds its data in order."""
