"""A hollow block whose filled lumen is opened by a cut: its content may go, the wall keeps its volumes."""

from dataclasses import replace

import numpy as np
import pytest

from massspring import (
    Attachment,
    Event,
    ImplicitVolume,
    MassSpringError,
    Ramp,
    Setup,
    Volumes,
    make_clock,
    quadratic_body,
    simulate,
    step_limit,
)
from massspring.body.opening import opened, parents
from massspring.body.partition import tetrahedron_faces
from massspring.body.quadratic import boundary_facets
from massspring.run.stages import stages_of
from tests.massspring.conftest import SOFT, boundary, hollow_block
from tests.massspring.cuts import body_of_cells
from tests.massspring.quadratic import second_order

CELLS, EDGE, FILLED = 4, 0.02, 1.15
KINDS = ("wall and lumen", "nodal", "quadratic")


class Opened:
    """A box with walls one cell thick, fixed at its bottom and filled, then cut through its lid from edge to edge."""

    def __init__(self, kind: str, at: int = 20, frames: int = 60):
        self.corners, _, cells, self.lumen = hollow_block(CELLS, EDGE)
        grid = np.round(self.corners / EDGE)
        faces, _, second = tetrahedron_faces(cells)
        faces = faces.astype(np.int64)
        lid = (grid[faces][:, :, 0] == 2).all(axis=1) & (grid[faces][:, :, 2] >= 3).all(axis=1) & (second >= 0)
        faces = faces[lid]
        a, b, c = grid[faces].transpose(1, 0, 2)
        turned = np.cross(b - a, c - a)[:, 0] < 0
        faces[turned] = faces[turned][:, ::-1]
        self.kind, self.corner_cells = kind, cells
        points = self.corners
        if kind == "quadratic":
            points, cells = second_order(points, cells)
        opening = opened(cells, faces, len(points))
        self.points, self.cells, self.opening = points, cells, opening
        self.before = self.body(points, cells, self.lumen)
        self.after = self.body(points[opening.parent], opening.cells, None)
        limit = step_limit(self.after)
        count = self.after.kept.count
        if kind == "quadratic":
            volumes = parents(self.before.kept.corner_volume, self.after.kept.corner_volume)
        else:
            volumes = opening.parent if kind == "nodal" else np.zeros(count, dtype=int)
        self.event = Event(
            self.after, opening.parent, volumes, at, self.held(self.after), ended=(self.before.kept.count - 1,)
        )
        self.setup = Setup(
            self.before,
            ImplicitVolume(tolerance=1e-9, most_iterations=500),
            make_clock(3.0, frames, 0.5 * limit.damped, limit),
            attachments=self.held(self.before),
            damping=30.0,
            targets={"lumen": Ramp((0.0, 0.5), (1.0, FILLED))},
            events=(self.event,),
        )

    def body(self, points, cells, lumen):
        if self.kind == "quadratic":
            return quadratic_body(points, cells, SOFT, None if lumen is None else self._facets(lumen))
        body = body_of_cells(points, cells)
        surfaces = {} if lumen is None else {"lumen": lumen}
        if self.kind == "nodal":
            nodal = Volumes.nodal(body)
            return body.keeping(nodal.joined(Volumes.closed_surfaces(body, surfaces)) if surfaces else nodal)
        return body.keeping(Volumes.closed_surfaces(body, {"wall": body.triangles, **surfaces}))

    def _facets(self, lumen):
        facets = boundary_facets(self.cells.astype(np.uint32)).astype(np.int64)
        lumen_faces = {tuple(sorted(row)) for row in lumen.tolist()}
        inner = [tuple(sorted(row)) in lumen_faces for row in facets[:, :3].tolist()]
        return facets[inner][:, [0, 2, 1, 5, 4, 3]]

    def held(self, body):
        return (Attachment(np.flatnonzero(body.rest[:, 2] < 0.25 * EDGE)),)

    def content(self, x: np.ndarray) -> float:
        """Volume of the lumen [m³] of the positions `x` after the cut: its surface, and a lid over the gap."""
        lumen_faces = {tuple(sorted(row)) for row in self.lumen.tolist()}
        triangles = boundary(self.opening.cells[:, :4].astype(np.int64))
        was = self.opening.parent[triangles]
        inner = np.array([tuple(sorted(row)) in lumen_faces for row in was.tolist()])
        inside = triangles[inner][:, ::-1]
        half = inside[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        there = {tuple(row) for row in half.tolist()}
        open_sides = [(a, b) for a, b in there if (b, a) not in there]
        copy = dict(self.opening.pairs[:, ::-1].tolist()) | dict(self.opening.pairs.tolist())
        assert open_sides
        lids = []
        for a, b in open_sides:
            c, d = copy.get(b, b), copy.get(a, a)
            if (a, b) < (d, c):  # each side of the gap once
                lids += [row for row in ((b, a, d), (b, d, c)) if len(set(row)) == 3]
        surface = np.concatenate([inside, np.array(lids)])
        p, q, r = (x[corner] - x.mean(axis=0) for corner in surface.T)
        return float(np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6.0)


def euler(triangles: np.ndarray) -> int:
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return len(np.unique(triangles)) - len(edges) + len(triangles)


def test_a_cut_through_the_wall_joins_its_two_surfaces():
    cut = Opened("nodal")
    assert euler(boundary(cut.corner_cells)) == 4
    assert euler(boundary(cut.opening.cells.astype(np.int64))) == 2


@pytest.mark.parametrize("kind", KINDS)
def test_the_content_goes_and_the_wall_keeps_its_volumes(kind):
    cut = Opened(kind)
    history = simulate(cut.setup, snapshots=(20, 60))
    assert history.outcome == "finished", history.message
    rest = cut.content(cut.after.rest)
    assert rest == pytest.approx(
        Volumes.closed_surfaces(cut.before, {"l": cut.lumen}).measure(cut.points)[0], rel=1e-12
    )
    full, empty = (cut.content(x) for x in history.snapshots)
    flat = kind != "quadratic"  # its lumen has curved sides
    assert full == pytest.approx(FILLED * rest, rel=1e-3 if flat else 1e-2)
    # Nothing loads it then: it goes back to what it was, and its content with it.
    assert empty == pytest.approx(rest, rel=1e-4)
    np.testing.assert_allclose(history.final, cut.after.rest, atol=1e-4 * cut.after.size)
    wall = history.volume.sum(axis=1)
    np.testing.assert_allclose(wall, cut.after.rest_volumes.sum(), rtol=1e-4)
    np.testing.assert_allclose(history.volume[-1], cut.after.rest_volumes, rtol=1e-4)
    (passed,) = history.passages
    assert passed.energy < 1e-12 and passed.momentum < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_no_pressure_of_the_content_is_left(kind):
    cut = Opened(kind)
    first, second = stages_of(cut.setup)
    state = first.start
    for frame in range(second.frame):
        state = cut.setup.method.advance(state, first.boundary(frame))
    entered = second.entered(state).start
    assert abs(state.lam[-1]) > 100.0 and len(entered.lam) == cut.after.kept.count
    np.testing.assert_array_equal(entered.lam, state.lam[np.asarray(cut.event.volume_parent)])
    assert "lumen" in cut.setup.targets and not second.setup.targets


def test_opened_it_comes_to_rest_where_a_body_does_that_was_never_filled():
    cut = Opened("nodal")
    pushed = replace(cut.setup, gravity=(0.0, 0.0, -2.0))
    history = simulate(pushed)
    alone = replace(pushed, body=cut.after, attachments=cut.held(cut.after), targets={}, events=())
    other = simulate(alone)
    assert np.abs(other.final - cut.after.rest).max() > 1e-3 * cut.after.size
    np.testing.assert_allclose(history.final, other.final, atol=1e-6 * cut.after.size)


def test_volumes_that_cannot_end_are_refused():
    cut = Opened("nodal")
    count = cut.before.kept.count
    for ended in ((count,), (count - 1, count - 1)):
        with pytest.raises(MassSpringError, match=f"are not among the {count} before it, or one is given twice"):
            replace(cut.setup, events=(replace(cut.event, ended=ended),))
    with pytest.raises(MassSpringError, match=f"do not name all {count} before it"):
        replace(cut.setup, events=(replace(cut.event, ended=()),))
