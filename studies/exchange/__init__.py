"""Export of scenes for other programs as plain files, and evaluation of their results in the same way as our runs."""
