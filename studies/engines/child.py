"""The process in which a worker of a cluster does pieces: started for one client, it knows no cluster."""

import pickle
import sys
from multiprocessing.connection import Connection

from studies.base.interrupts import die_quietly, end_after
from studies.sweep.workers import Death, sendable

IDLE_SECONDS = 1800.0
"""Without a request, after which it ends: its client may be gone without a word."""


def main(descriptor: int) -> None:
    """Answers what comes along the line (studies.engines.requests, pickled) until it is closed, nothing comes any more,
    or the worker is gone."""
    die_quietly()
    end_after(sys.stdin.buffer.read)  # the worker alone holds its other end
    line = Connection(descriptor)
    while line.poll(IDLE_SECONDS):
        try:
            message = line.recv_bytes()
        except EOFError:
            return
        line.send_bytes(pickle.dumps(answered(message)))


def answered(message: bytes) -> object:
    """What came of a request: its answer, a Death, or the error that it raised."""
    try:
        return pickle.loads(message).answer()
    except MemoryError:
        return Death("it ran out of memory")
    except Exception as error:  # a user's file may raise anything
        return sendable(error)
