"""Frame loops that several methods share."""
