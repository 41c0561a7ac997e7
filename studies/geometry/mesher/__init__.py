"""The worker process that meshes a recipe, and the jobs that start it; only this package calls gmsh and MMG."""
