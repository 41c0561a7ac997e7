import signal

import pytest


@pytest.fixture
def heard():
    """Restores Ctrl-C's signal, which a shell's background job and its children ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
