"""Frame times that can be trusted."""
