"""Springs fitted to the reference in some scenes of an organ, and judged in others."""
