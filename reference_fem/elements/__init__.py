"""Shape functions, quadrature, curved meshes, evaluation at points."""
