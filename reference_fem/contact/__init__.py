"""Contact with rigid obstacles at quadrature points."""
