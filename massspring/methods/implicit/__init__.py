"""The passes of implicit springs."""
