"""Arrays that are built once before a run, in the memory layout that a step needs."""
