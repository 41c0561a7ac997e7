"""Bodies side by side as one grid of cells that moves in steps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.base.errors import StudyError
from studies.report.view.bodies import Shown

GAP = 1.25
"""From one body to the next, over the size of the largest."""


@dataclass(frozen=True, eq=False)
class Data:
    """Numbers of a grid. values: (K, rows, …) where they change with the step, else (rows, …)."""

    values: np.ndarray
    moves: bool
    unit: str
    description: str

    @property
    def rows(self) -> int:
        return self.values.shape[1 if self.moves else 0]

    @property
    def columns(self) -> int:
        return int(np.prod(self.values.shape[2 if self.moves else 1 :]))


@dataclass(frozen=True, eq=False)
class Grid:
    """An unstructured grid in K steps whose cells stand still."""

    times: np.ndarray
    """[s], (K,)."""
    points: np.ndarray
    """[m], (K, n, 3)."""
    connectivity: np.ndarray
    """Points of all cells, one cell behind the other, (l,)."""
    offsets: np.ndarray
    """Where each cell begins in there, and the end, (c + 1,)."""
    types: np.ndarray
    """As VTK numbers them, (c,)."""
    point_data: dict[str, Data]
    cell_data: dict[str, Data]
    field_data: dict[str, Data]


def places(bodies: Sequence[Shown]) -> np.ndarray:
    """Where each body is moved to [m], (bodies, 3): in rows along x, the first on top (z)."""
    positions = [body.positions.reshape(-1, 3) for body in bodies]
    pitch = GAP * max(float(np.ptp(points, axis=0).max()) for points in positions)
    row, column = np.divmod(np.arange(len(bodies)), int(np.ceil(np.sqrt(len(bodies)))))
    return pitch * np.column_stack([column, 0 * row, -row])


def side_by_side(times: np.ndarray, bodies: Sequence[Shown]) -> Grid:
    """The bodies in one grid; point and cell data `case` number them as given.

    times: (K,) [s]. Raises StudyError when a body has another number of steps.
    """
    for body in bodies:
        if len(body.displacement) != len(times):
            raise StudyError(f"{body.name} has {len(body.displacement)} steps, not {len(times)}; view it alone")
    first = np.cumsum([0, *(len(body.rest) for body in bodies)])
    offset = np.repeat(places(bodies), np.diff(first), axis=0)
    lengths = np.concatenate([np.full(len(body.cells), body.cells.shape[1]) for body in bodies])
    numbers = np.arange(len(bodies), dtype=np.int32)
    return Grid(
        times=times,
        points=np.concatenate([body.positions for body in bodies], axis=1) + offset,
        connectivity=np.concatenate([(body.cells + n).ravel() for body, n in zip(bodies, first, strict=False)]),
        offsets=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        types=np.concatenate([np.full(len(body.cells), body.cell_type, np.uint8) for body in bodies]),
        point_data=_point_data(bodies, offset, np.repeat(numbers, np.diff(first))),
        cell_data={"case": Data(np.repeat(numbers, [len(body.cells) for body in bodies]), False, "1", CASE)},
        field_data=_field_data(times, bodies),
    )


CASE = "number of the body in case_name"


def _point_data(bodies: Sequence[Shown], offset: np.ndarray, case: np.ndarray) -> dict[str, Data]:
    data = {
        "displacement": Data(np.concatenate([b.displacement for b in bodies], axis=1), True, "m", "from rest"),
        "offset": Data(offset, False, "m", "shift of the body to the side: its positions are points minus this"),
        "case": Data(case, False, "1", CASE),
    }
    if any(body.error is not None for body in bodies):
        errors = [np.full_like(b.displacement, np.nan) if b.error is None else b.error for b in bodies]
        data["error"] = Data(np.concatenate(errors, axis=1), True, "m", "displacement minus that of the reference")
    return data


def _field_data(times: np.ndarray, bodies: Sequence[Shown]) -> dict[str, Data]:
    ratios, forces = (np.stack(rows, axis=1) for rows in ([b.volume_ratio for b in bodies], [b.force for b in bodies]))
    return {
        "time": Data(times[:, None, None], True, "s", "scene time of the step"),
        "volume_ratio": Data(ratios[:, None], True, "1", "V/V0 of each body: of the volume that is farthest off"),
        "force": Data(forces[:, None], True, "N", "the probed force of each body"),
        "case_name": Data(np.array([body.name for body in bodies]), False, "", "description of each body"),
    }
