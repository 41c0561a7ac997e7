from tests.studies.peers.dummies import unable as run  # noqa: F401
