"""What a body will do before it runs: stiffness, step limit, modes."""
