from tests.studies.peers.dummies import crashed as run  # noqa: F401
