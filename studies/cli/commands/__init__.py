"""Commands, one per module; studies.cli.loading loads the one that is called."""
