"""A cut that advances over a mesh: the body is valid at each stage, and all of the cut is open at the end."""

import itertools

import numpy as np
import pytest
from scipy.spatial import Delaunay

from massspring import MassSpringError
from massspring.body.opening import opened
from studies.meshing import opened_mesh
from studies.meshing.opened_mesh import faces_in_stages
from tests.massspring.conftest import block, boundary
from tests.massspring.cuts import layer_faces

CELLS = (4, 5, 6)
SHARES, MANY = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 30)
MEETING = (0, 4, 16, 17)
"""Seeds of sections whose surface would meet itself on the way."""


def parting_nodes(cells: np.ndarray, faces: np.ndarray, n: int) -> np.ndarray:
    parting = np.zeros(n, dtype=bool)
    parting[opened(cells, faces, n).pairs[:, 0]] = True
    return parting


def fans(triangles: np.ndarray) -> dict[int, int]:
    """How many fans of triangles are around each node of a closed surface: one, or it meets itself there."""
    around: dict[int, dict[int, list[int]]] = {}
    for triangle in triangles.tolist():
        for k in range(3):
            links = around.setdefault(triangle[k], {})
            one, other = triangle[(k + 1) % 3], triangle[(k + 2) % 3]
            links.setdefault(one, []).append(other)
            links.setdefault(other, []).append(one)
    count = {}
    for node, links in around.items():
        left, count[node] = set(links), 0
        while left:
            count[node] += 1
            todo = [left.pop()]
            while todo:
                near = [other for other in links[todo.pop()] if other in left]
                left -= set(near)
                todo += near
    return count


def wrong(cells: np.ndarray, faces: np.ndarray, n: int) -> str | None:
    """The fault of the surface of a body that is opened along some faces, found on the surface itself."""
    try:
        triangles = boundary(opened(cells, faces, n).cells.astype(np.int64)) if len(faces) else boundary(cells)
    except MassSpringError as error:
        return str(error)
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    if (np.unique(ends, axis=0, return_counts=True)[1] != 2).any():
        return "an edge has more than two triangles"
    return "a node has two fans" if max(fans(triangles).values()) > 1 else None


def disc(seed: int, inner: bool = False, count: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells of a slab over random points of a disc, the triangles between its two layers, or the `inner` of them, and
    places along a direction."""
    random = np.random.default_rng(seed)
    radius, turn = np.sqrt(random.uniform(0.0, 1.0, count)), random.uniform(0.0, 2 * np.pi, count)
    flat = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    triangles = Delaunay(flat).simplices.astype(np.int64)
    i, j, k = np.sort(triangles, axis=1).T
    layer = np.concatenate([[i, j, k, k + count], [i, j, j + count, k + count], [i, i + count, j + count, k + count]])
    half = layer.reshape(3, 4, -1).transpose(0, 2, 1).reshape(-1, 4)
    cells = np.concatenate([half, half + count])
    points = np.concatenate([np.column_stack([flat, np.full(count, z)]) for z in (-0.1, 0.0, 0.1)])
    a, b, c, d = points[cells].transpose(1, 0, 2)
    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    cells[negative] = cells[negative][:, [0, 2, 1, 3]]
    assert (np.linalg.det(np.diff(flat[triangles], axis=1)) > 0).all()  # seen from in front
    if inner:
        triangles = triangles[(np.linalg.norm(flat[triangles], axis=2) < 0.5).any(axis=1)]
    return cells, triangles + count, points @ [*random.standard_normal(2), 0.0]


DIRECTIONS = [(0, 0, -1), (0, 0, 1), (0, 1, 0), (0, -1, -1), (0, 3, -1), (1, 0, -4)]


@pytest.mark.parametrize("reach", [3, np.inf])
@pytest.mark.parametrize("along", DIRECTIONS)
def test_faces_open_in_order_until_all_are_open(reach, along):
    points, _, cells = block(CELLS)
    faces, n = layer_faces(cells, CELLS, CELLS[0] // 2, reach), len(points)
    parting, place = parting_nodes(cells, faces, n), points @ np.asarray(along, float)
    stages = faces_in_stages(faces, parting, place, SHARES)
    assert stages[-1].all() and 0 < stages[0].sum() < len(faces)
    for before, after in itertools.pairwise(stages):
        assert not (before & ~after).any()
    first, last = place[parting].min(), place[parting].max()
    waiting = 0
    for share, stage in zip(SHARES, stages, strict=True):
        assert wrong(cells, faces[stage], n) is None
        reached = parting & (place <= first + (share + 1e-9) * (last - first))
        # Nothing opens that the front has not reached, but what all open faces enclose.
        doubled = parting_nodes(cells, faces[stage], n)
        assert not (doubled & ~reached).any() or np.isin(np.flatnonzero(doubled & ~reached), faces[~stage]).sum() == 0
        waiting = max(waiting, int((reached & ~doubled).sum()))
    assert waiting <= 3


@pytest.mark.parametrize(("seed", "inner"), [*((k, False) for k in MEETING), *((k, True) for k in (1, 2, 3, 5, 7, 8))])
def test_random_sections_open_without_meeting_themselves(seed, inner):
    cells, faces, along = disc(seed, inner)
    n = len(along)
    assert wrong(cells, faces, n) is None  # once all is open
    stages = faces_in_stages(faces, parting_nodes(cells, faces, n), along, MANY)
    assert [wrong(cells, faces[stage], n) for stage in stages] == [None] * len(stages)
    assert len({int(stage.sum()) for stage in stages}) > 4


def test_without_waiting_some_surfaces_would_meet_themselves(monkeypatch):
    """The tests above can fail."""
    monkeypatch.setattr(opened_mesh, "meetings", lambda faces, parting, passed: np.zeros(len(passed), dtype=bool))
    faults = set()
    for seed in MEETING:
        cells, faces, along = disc(seed)
        n = len(along)
        stages = faces_in_stages(faces, parting_nodes(cells, faces, n), along, MANY)
        faults |= {wrong(cells, faces[stage], n) for stage in stages}
    assert {"an edge has more than two triangles", "a node has two fans"} <= faults


def test_a_front_passes_several_nodes_at_once_or_none():
    """Rows of equal height: shares between two rows open nothing."""
    points, _, cells = block(CELLS, distortion=0.0)
    faces, n = layer_faces(cells, CELLS, CELLS[0] // 2), len(points)
    shares = np.linspace(0.0, 1.0, 2 * CELLS[2] + 1)
    stages = faces_in_stages(faces, parting_nodes(cells, faces, n), points @ [0.0, 0.0, 1.0], shares)
    counts = [int(stage.sum()) for stage in stages]
    assert counts[1:-1:2] == counts[:-2:2] and np.all(np.diff(counts[:-2:2]) == 2 * CELLS[1])
