from tests.studies.exchange.peers.dummies import unable as run  # noqa: F401
