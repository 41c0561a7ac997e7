"""Scenes for programs of others, and what these hand in: written as plain files, judged as our own runs are."""
