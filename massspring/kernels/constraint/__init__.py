"""Kernels for the pressures (Lagrange multipliers) that keep volumes."""
