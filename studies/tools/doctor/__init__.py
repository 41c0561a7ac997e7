"""Whether this machine has what organbench needs, and the command that fixes it."""
