"""The league of engines: other programs, and ours, on the open scenes of the frozen set."""
