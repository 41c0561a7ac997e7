"""Analysis of a body at rest, before a run: stiffness, step limit, modes."""
