"""Volumes of quadratic tetrahedra, summed over points inside the elements; their gradients are never assembled."""
