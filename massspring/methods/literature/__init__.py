"""Other approaches from the literature, which omit the volume constraint, forces, masses or large rotations.

They run through the same scenes, records and metrics as METHODS, but do not claim what those do, such as momentum in
free flight or the order of a trajectory. Their files state their claims, which are tested separately.
"""
