"""What a scene is made of: organ, tissue, loads, clock, quantities."""
