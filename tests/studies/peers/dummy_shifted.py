from tests.studies.peers.dummies import shifted as run  # noqa: F401
