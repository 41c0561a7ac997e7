"""What the charts of incisions say: openings over the depth, widest gaps, and forces before and after the cut."""

from dataclasses import replace

import numpy as np
import pytest

from massspring.body.opening import opened
from studies.geometry import HalfSpace
from studies.geometry.mesh.organ_mesh import boundary_triangles
from studies.plots import cut_open, opening
from studies.plots.style.style import BLACK
from studies.scene.cut import Cut
from tests.studies import made_up_run
from tests.studies.plots.reading import lines, words
from tests.studies.tiny import cube

MIDDLE, FRONT = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
SCENE = replace(made_up_run.SCENE, cuts=(Cut("slit", MIDDLE, within=FRONT, at=2.0),))


def slit(wedge=0.2, truth=0.1):
    """A cube of 100 mm with a cut to its middle, whose upper face rises by `wedge` of the distance from the front; in
    the reference by `truth` of it. The force is 0.04 N before the cut and 1.8 N after it; in the reference 1 and 2 N.
    """
    points, _, cells = cube(4, made_up_run.EDGE)
    faces = np.sort(cells[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    faces = np.unique(
        faces[(points[faces][..., 2] == 0).all(axis=1) & (points[faces][..., 0] <= 0).all(axis=1)], axis=0
    )
    a, b, c = points[faces].transpose(1, 0, 2)
    below = np.cross(b - a, c - a)[:, 2] < 0
    faces[below] = faces[below][:, ::-1]  # seen anticlockwise from above
    mesh = opened(cells, faces, len(points))
    rest, moved = points[mesh.parent], np.zeros((len(mesh.parent), 3))
    moved[mesh.pairs[:, 1], 2] = -wedge * rest[mesh.pairs[:, 1], 0]
    values = {
        "rest": rest,
        "snapshots": np.stack([rest, rest + moved]),
        "mass": np.ones(len(rest)),
        "triangles": boundary_triangles(mesh.cells.astype(int)),
        "tetrahedra": mesh.cells.astype(int),
        "cut_pairs": mesh.pairs,
        "cut_faces": faces,
    }
    reference = made_up_run.reference()
    reference.opening = lambda x: np.column_stack([0 * x[:, 0], 0 * x[:, 0], -truth * x[:, 0]])
    reference.triangles, field = values["triangles"], reference.field
    reference.surface = lambda: (rest + moved * truth / wedge, values["triangles"])
    reference.field = lambda name: rest if name == "nodes" else field(name)
    return made_up_run.run(scene=SCENE, values=values, force=(0.0, 0.04, 1.0, 1.8), reference=reference)


def test_an_opening_is_drawn_over_the_distance_from_the_front():
    (panel,) = opening.figure([slit()]).axes
    (truth,), (body,) = lines(panel, BLACK), [line for line in panel.get_lines() if line.get_marker() == "None"]
    assert list(body.get_xdata()) == pytest.approx([25, 50]) and list(body.get_ydata()) == pytest.approx([5, 10])
    assert list(truth.get_xdata()) == pytest.approx([25, 50]) and list(truth.get_ydata()) == pytest.approx([2.5, 5])


def test_a_cut_body_shows_its_gap_and_its_forces():
    before, after, reference = (words(panel) for panel in cut_open.figure([slit()]).axes)
    assert "force 40.00 mN" in before
    assert "gapes 10.0 mm, force 1.80 N (−10.0 %)" in after and "gapes 5.0 mm, force 2.00 N" in reference
    assert cut_open.in_newtons(-0.25) == "−0.25 N" and cut_open.in_newtons(-0.0999) == "−99.90 mN"
