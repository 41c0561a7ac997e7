from tests.studies.peers.dummies import hung as run  # noqa: F401
