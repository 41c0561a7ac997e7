"""Common parts of all charts: page, colours, three-dimensional pictures."""
