"""Triangulations: making, moving onto a level function, editing, repairing and comparing them."""
