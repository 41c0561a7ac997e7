"""Volumes of quadratic tetrahedra, summed over points inside the elements; the matrix of their gradients is never
assembled."""
