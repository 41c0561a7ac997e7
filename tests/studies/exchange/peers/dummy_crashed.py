from tests.studies.exchange.peers.dummies import crashed as run  # noqa: F401
