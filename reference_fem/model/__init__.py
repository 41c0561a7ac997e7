"""What is solved: material, loads, obstacles, cavities, the problem as a whole."""
