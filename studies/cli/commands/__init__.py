"""Commands, one per module; studies.cli.groups loads the one that is called."""
