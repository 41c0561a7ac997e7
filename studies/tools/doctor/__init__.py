"""Whether this machine has what organbench needs, and the line that mends it."""
