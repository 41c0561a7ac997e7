"""Scenes and their parts: organ, tissue, loads, clock, quantities."""
