"""Commands, one per module. Adding one: a file here, and a line in `GROUPS` (studies.cli.groups)."""
