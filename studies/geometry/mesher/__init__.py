"""The worker process that meshes a recipe; gmsh is called here only."""
