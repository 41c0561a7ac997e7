import signal

import pytest


@pytest.fixture
def heard():
    """A shell's background job, and what it starts, ignores Ctrl-C's signal; here it is meant."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
