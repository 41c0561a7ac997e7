"""What all charts share: page, colours, three-dimensional pictures."""
