"""Cases: their description, preparation, run and status."""
