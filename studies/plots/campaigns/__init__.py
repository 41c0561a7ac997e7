"""Charts of many runs: random trials, recovery, stability, other programs, populations."""
