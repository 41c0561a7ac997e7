from tests.studies.peers.dummies import squeezed as run  # noqa: F401
