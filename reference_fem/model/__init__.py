"""The problem to be solved: material, loads, obstacles, cavities."""
