from tests.studies.exchange.peers.dummies import squeezed as run  # noqa: F401
