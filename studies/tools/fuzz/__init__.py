"""A campaign that tries to break every method: random bodies, steps, starts and surroundings, each ending named."""
