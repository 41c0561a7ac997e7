"""What is wrong with a mesh, and which option mends it."""
