"""Other ways of the literature to deform an organ, which leave forces, masses or large turns out.

They run through the same scenes, records and metrics as METHODS, but do not promise what those do: no momentum in free
flight, no order of a trajectory. What they promise stands in their files and is tested there.
"""
