"""The discrete equations: assembly, saddle-point system, linear solvers, state."""
