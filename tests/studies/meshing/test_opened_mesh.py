"""Opened meshes: valid at each stage of a cut that advances; plane strain along a slit does not depend on the slit."""

import itertools

import numpy as np
import pytest
from scipy.spatial import Delaunay
from skfem import MeshTet, MeshTet2

from massspring import MassSpringError
from massspring.body.opening import opened
from reference_fem import NeoHookean, PrescribedDisplacement, Problem, equilibrium_path, nodes
from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import counted_edges, turn_inverted
from studies.meshing import opened_mesh
from studies.meshing.opened_mesh import faces_in_stages, opened_elements
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
    if (counted_edges(triangles)[1] != 2).any():
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
    cells = turn_inverted(points, cells)
    assert (np.linalg.det(np.diff(flat[triangles], axis=1)) > 0).all()  # seen from in front
    if inner:
        triangles = triangles[(np.linalg.norm(flat[triangles], axis=2) < 0.5).any(axis=1)]
    return cells, triangles + count, points @ [*random.standard_normal(2), 0.0]


DIRECTIONS = [(0, 0, -1), (0, 1, 0), (0, 3, -1), (1, 0, -4)]


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


FEW, HEIGHT, EDGE = (2, 3, 3), 2, 0.02
STRAIN = np.diag([1.0, 1.1, 1.0 / 1.1]) - np.eye(3)
MATERIAL = NeoHookean(1800.0, 1e4 * 1800.0)


def opened_block() -> tuple[MeshTet2, np.ndarray]:
    """A block cut flat between its layers up to a front inside, and the parent of each node."""
    points, _, tetrahedra = block(FEW, EDGE)
    at = np.unravel_index(np.arange(len(points)), np.add(FEW, 1))[0]
    points[at == FEW[0] // 2, 0] = EDGE * (FEW[0] // 2)
    flat = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra.T))
    return opened_elements(MeshTet2.from_mesh(flat), layer_faces(tetrahedra, FEW, FEW[0] // 2, HEIGHT))


def test_plane_strain_along_a_slit_keeps_it_shut():
    """But for what a finite bulk modulus leaves: the law's deviator pulls at the sides, mu/kappa of it is seen."""
    mesh, parent = opened_block()
    x = nodes(mesh)
    slit = np.bincount(parent)[parent] == 2
    inside = slit & (x[:, 1] > 0.005) & (x[:, 1] < 0.055) & (x[:, 2] > 0.005)
    assert inside.sum() >= 4
    places = {tuple(place) for place in np.round(x[inside], 9)}

    def outside(at: np.ndarray) -> np.ndarray:
        return np.array([tuple(place) not in places for place in np.round(at.T, 9)])

    held = PrescribedDisplacement(outside, motion=lambda t: (t, t, t), shape=lambda at: STRAIN @ at)
    (state,) = equilibrium_path(Problem(mesh, MATERIAL, (held,)), [1.0])
    np.testing.assert_allclose(state.u[inside], x[inside] @ STRAIN, atol=1e-4 * np.ptp(x))
    # What is held apart from its slit moves otherwise: the copies are free of each other.
    pulled = PrescribedDisplacement(
        lambda at: outside(at) & (np.abs(at[0] - EDGE) > 0.5 * EDGE),
        motion=lambda t: (t, t, t),
        shape=lambda at: np.stack([0.1 * at[0], 0 * at[1], 0 * at[2]]),
    )
    (state,) = equilibrium_path(Problem(mesh, MATERIAL, (pulled,)), [1.0])
    pairs = np.flatnonzero(slit)[np.argsort(parent[slit], kind="stable")].reshape(-1, 2)
    assert np.abs(np.diff(state.u[pairs, 0], axis=1)).max() > 0.02 * EDGE


def test_faces_that_are_not_between_elements_are_refused():
    points, triangles, tetrahedra = block(FEW, EDGE)
    flat = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra.T))
    with pytest.raises(StudyError, match="is not opened by the cut"):
        opened_elements(MeshTet2.from_mesh(flat), triangles[:1])
