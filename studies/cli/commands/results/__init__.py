"""Commands that read, draw, compare and publish what is stored."""
