"""Kernels for contact: which nodes touch obstacles, and the motion that contact removes."""
