from tests.studies.exchange.peers.dummies import hung as run  # noqa: F401
