"""Commands in rooms, one per module; studies.cli.app loads the one that is called."""
