"""What a frame loop is given."""
