"""Which worker gets which piece: the longest first, each where its memory suffices, none before its worker is checked.

No cluster is known here: only names, numbers and what is told.
"""

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from studies.sweep.tasks import Task
from studies.sweep.workers import TRIES

GB = 1e9


@dataclass
class Member:
    """A worker that may get pieces."""

    address: str
    name: str
    machine: str
    """Id of its machine."""
    threads: int
    """Pieces at a time."""
    memory: float
    """Bytes for all of them; 0 where it has no limit."""
    busy: dict[int, float] = field(default_factory=dict)
    """Number of a piece that it has -> bytes that it may need."""

    def suffices(self, need: float) -> bool:
        """Whether it could do a piece of so many bytes, with nothing beside."""
        return not self.memory or need <= self.memory

    def has_room(self, need: float) -> bool:
        """Whether it could do so beside what it has."""
        return self.suffices(need + sum(self.busy.values()))


class Fleet:
    """Workers by address, and the pieces that wait, by number."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        self.tasks = list(tasks)
        self.needs = [task.needs for task in tasks]
        self.waiting = deque(range(len(tasks)))
        self.members: dict[str, Member] = {}
        self.tries = Counter[int]()
        self.left = len(tasks)
        """Pieces that have not ended."""

    def handed_out(self) -> Iterator[tuple[str, int]]:
        """Gives pieces that wait to members that can take them: (address, number of the piece)."""
        for member in self.members.values():
            while (number := self._next_for(member)) is not None:
                self.waiting.remove(number)
                member.busy[number] = self.needs[number]
                yield member.address, number

    def _next_for(self, member: Member) -> int | None:
        if len(member.busy) >= member.threads:
            return None
        return next((number for number in self.waiting if member.has_room(self.needs[number])), None)

    def done(self, address: str, number: int) -> None:
        """A piece is done."""
        self._freed(address, number)
        self.left -= 1

    def died(self, address: str, number: int) -> bool:
        """A piece has cost a process. Whether that was its last try: then it has ended."""
        self._freed(address, number)
        self.tries[number] += 1
        if self.tries[number] == TRIES:
            self.left -= 1
            return True
        self.waiting.append(number)
        return False

    def _freed(self, address: str, number: int) -> None:
        if address in self.members:
            self.members[address].busy.pop(number, None)

    def gone(self, address: str) -> list[int]:
        """A worker is gone: the pieces that it had; one that was not checked yet had none."""
        member = self.members.pop(address, None)
        return [] if member is None else list(member.busy)

    def too_large(self) -> tuple[Task, float] | None:
        """The largest piece that waits and no member could ever do, with its need [bytes]; None without one."""
        number = max(self.waiting, key=lambda number: self.needs[number], default=None)
        if number is None or any(member.suffices(self.needs[number]) for member in self.members.values()):
            return None
        return self.tasks[number], self.needs[number]
