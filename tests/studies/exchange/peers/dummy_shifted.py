from tests.studies.exchange.peers.dummies import shifted as run  # noqa: F401
