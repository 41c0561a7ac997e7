"""The held nodes of a mesh file: the same wherever the organ lies, and as many as the mesher put into the region."""

from dataclasses import replace

import meshio
import numpy as np
import pytest

from studies.geometry import HalfSpace, ball
from studies.meshing.scene_mesh import mesh_for, patch_nodes
from studies.scene.library.ball_clamped import BALL_CLAMPED
from studies.scene.scene import Organ

NORMAL = (0.48, -0.6, -0.64)


@pytest.mark.parametrize(("suffix", "kind"), [("vtu", np.float64), ("ply", np.float32)])
@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (10.0, -7.0, 3.0), (121.0, 0.1, 0.3)])
def test_a_moved_organ_holds_the_same_nodes(tmp_path, shift, suffix, kind):
    made = ball(100, regions={"end": HalfSpace((0.0, 0.0, 0.02), NORMAL)}, fill=False)
    path = tmp_path / f"ball.{suffix}"
    points = (made.points + shift).astype(kind)
    meshio.write_points_cells(path, points, [("triangle", made.triangles.astype(np.int32))])
    scene = replace(BALL_CLAMPED, organ=Organ("file", {"path": str(path), "unit": "m"}))
    region = HalfSpace((shift[0], shift[1], shift[2] + 0.02), NORMAL)
    held = patch_nodes(mesh_for(scene, 0, filled=False), "end", region)
    assert held.tolist() == made.patches["end"].tolist()
    assert (np.abs(region.level(points[held])) < 1e-4).sum() > 5  # some lie on the outline
