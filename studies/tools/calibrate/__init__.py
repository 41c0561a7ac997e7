"""Springs fitted to the reference in some scenes of an organ and judged in others: what no better element can mend."""
