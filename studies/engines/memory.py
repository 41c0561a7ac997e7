"""What a piece needs of a machine's memory: declared before it is given to a worker."""

from studies.base.errors import StudyError
from studies.reference.reference_solves import ReferenceSolve
from studies.store.record import peek
from studies.sweep.tasks import Task

BASE = 0.3e9
"""Of any process, with the libraries and a body [bytes]; 0.2e9 are measured."""
PER_UNKNOWN, MEASURED = 17e3, 90_000
"""Of a reference of up to so many unknowns [bytes for each]: 14.2e3 are measured for 25,423 (kidney_probe, MKL), and
13.3e3 for 89,598."""
ORDER = 1 / 3
"""Of the growth of that beyond: factors of a matrix over a volume of n points have n^(4/3) numbers (George 1973)."""
PER_NODE, PER_EDGE = 6.5, 60.0
"""Unknowns of a reference for n surface nodes, over n^1.5; of an octant for a size h over its radius, times h^3. No
scene of the catalogue has more."""


def need_of(task: Task) -> float:
    """Bytes that a piece may take, rather too many."""
    if not isinstance(task.work, ReferenceSolve):
        return BASE
    return BASE + factors(unknowns_of(task, task.work))


def factors(unknowns: float) -> float:
    """Bytes of the factors of so many unknowns, with what is kept beside them."""
    return PER_UNKNOWN * unknowns * max(1.0, unknowns / MEASURED) ** ORDER


def unknowns_of(task: Task, solve: ReferenceSolve) -> float:
    """Of a reference: as its last result says, else by the size of its mesh."""
    try:
        known = peek(task.path()).attributes.get("unknowns")
    except StudyError:
        known = None
    if known:
        return float(known)
    level = solve.level
    return PER_NODE * level**1.5 if level > 1 else PER_EDGE / level**3
