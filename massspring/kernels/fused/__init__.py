"""Springs, volume gradient and prediction in one pass over the nodes."""
