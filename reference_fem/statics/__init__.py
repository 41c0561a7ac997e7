"""Equilibrium along a load path: Newton, contact status, tangents."""
