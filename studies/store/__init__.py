"""One file per result, whole or not at all."""
