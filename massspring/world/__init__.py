"""What surrounds a body: obstacles, attachments, the clock, targets of volumes."""
