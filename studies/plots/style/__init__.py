"""Common parts of all charts: page, colours, shaded pictures."""
