"""Surroundings of a body: obstacles, attachments, clock, targets of volumes."""
