"""Tetrahedra: the mesh of an organ, its quality, curved sides, walls."""
