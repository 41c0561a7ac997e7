"""Results that can be handed on and kept: one file that draws its own charts again."""
