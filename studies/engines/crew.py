"""Workers of a cluster as they come and go: each is checked before it gets a piece."""

import time
import warnings
from collections.abc import Iterator
from typing import Any

from studies.base.errors import StudyError
from studies.engines.apart import Setup
from studies.engines.checks import Check
from studies.engines.dask import Answer, Lines
from studies.engines.fleet import Fleet, Member
from studies.engines.requests import Request

LOOK_SECONDS = 1.0
"""Between two looks at which workers there are."""
CHECK = "check"
"""Label of a request that checks a worker; those of pieces are numbers."""


class Crew:
    """The workers of one sweep. A fault of one that is there at the beginning is an error; one that joins later with a
    fault is told of once, and gets nothing."""

    def __init__(self, lines: Lines, setup: Setup, check: Check, fleet: Fleet) -> None:
        self.lines, self.setup, self.check, self.fleet = lines, setup, check, fleet
        self.names: dict[str, str] = {}
        """Of all that were seen, by address."""
        self.checking: set[str] = set()
        self.begun = False
        self.looked = self.manned = time.monotonic() - LOOK_SECONDS
        """When the workers were looked at, and when there was one, last."""

    def assemble(self, patience: float) -> None:
        """Returns when all workers that are there are checked, and there is one. Raises StudyError for a fault, or
        when none comes within so many seconds."""
        self.manned = time.monotonic()
        while not self.fleet.members or self.checking:
            self.look()
            self.alive(patience)
            answer = self.lines.next_answer(0.2)
            if answer is not None:
                self.checked(answer)
        self.begun = True

    def look(self) -> list[int]:
        """Which workers are new, and which are gone: the numbers of the pieces that those had. Raises Lost."""
        if time.monotonic() < self.looked + LOOK_SECONDS:
            return []
        self.looked = time.monotonic()
        known = self.lines.workers()
        for address in [address for address in known if address not in self.names]:
            self.names[address] = known[address].name
            self.checking.add(address)
            self.send(address, self.check.request, (CHECK, known[address]))
        lost: list[int] = []
        for address in [address for address in self.names if address not in known]:
            del self.names[address]
            self.checking.discard(address)
            self.lines.drop(address)
            lost += self.fleet.gone(address)
        return lost

    def alive(self, patience: float) -> None:
        """Raises StudyError when there has been no worker for so many seconds."""
        if self.fleet.members or self.checking:
            self.manned = time.monotonic()
        elif time.monotonic() > self.manned + patience:
            raise StudyError(
                f"the cluster has had no worker for {patience:g} s: start some with `organbench worker`; what is "
                "finished is stored, the same command goes on from there"
            )

    def send(self, address: str, request: Request, label: Any) -> None:
        """A request for one worker."""
        self.lines.send(address, self.setup, request, label)

    def checked(self, answer: Answer) -> None:
        """A worker has answered who it is. Raises StudyError for a fault at the beginning."""
        _, found = answer.label
        self.checking.discard(answer.address)
        fault = self.check.fault(found.name, answer.value)
        if fault is None:
            identity, _ = answer.value
            member = Member(answer.address, found.name, identity.machine, found.threads, found.memory)
            self.fleet.members[answer.address] = member
        elif self.begun:
            warnings.warn(f"{fault}; it gets no piece", stacklevel=2)
        else:
            raise StudyError(f"{fault}; nothing has run")

    def machines(self) -> Iterator[list[Member]]:
        """The members of each kind of machine, by name."""
        members = sorted(self.fleet.members.values(), key=lambda member: member.name)
        for machine in sorted({member.machine for member in members}):
            yield [member for member in members if member.machine == machine]
