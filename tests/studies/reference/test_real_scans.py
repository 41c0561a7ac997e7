"""Real organs lifted, pressed and probed: how the loads are placed, and how far their references can be trusted."""

import warnings
from dataclasses import replace

import meshio
import numpy as np
import pytest

from studies.bench import scan_references
from studies.bench.scan_references import FINE, LIFTED, LOADS, PRESSED_IN, main, reference_of, refined, row, scan_scenes
from studies.geometry import organ
from tests.studies.geometry.real import real_surface

LIVER, SPLEEN, STOMACH = "liver_hra_4999", "spleen_hra_4997", "stomach_bp3d_5015"
WITHIN = (
    (LIVER, "lifted", 0.03),
    (LIVER, "pressed", 0.035),
    (LIVER, "probed", 0.05),
    (SPLEEN, "lifted", 0.03),
    (SPLEEN, "pressed", 0.03),
    (SPLEEN, "probed", 0.045),
    (STOMACH, "lifted", 0.03),
    (STOMACH, "pressed", 0.03),
    (STOMACH, "probed", 0.03),
)
"""Uncertainty of the last force that was measured, rounded up (docs/own-organ.md)."""


@pytest.fixture(scope="module")
def kidney(tmp_path_factory, mesh_cache):
    """A kidney of 200 nodes in a file in millimetres, its nodes [m], and its three scenes."""
    mesh = organ("kidney", 200, fill=False)
    path = tmp_path_factory.mktemp("loads") / "kidney.ply"
    meshio.write(path, meshio.Mesh(1e3 * mesh.points, [("triangle", mesh.triangles)]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scan_references, "NODES", 150)
        return mesh.points, scan_scenes(path)


@pytest.mark.campaign
def test_the_free_end_is_grasped_and_lifted_across_the_length(kidney):
    points, scenes = kidney
    held = [one.region.level(points) <= 0 for one in scenes["lifted"].held]
    assert not (held[0] & held[1]).any() and all(0.03 < part.mean() < 0.2 for part in held)
    along = points[held[1]].mean(axis=0) - points[held[0]].mean(axis=0)
    way = scenes["lifted"].held[1].path(scenes["lifted"].duration)
    assert abs(along @ way) < 0.2 * np.linalg.norm(along) * np.linalg.norm(way)
    assert np.linalg.norm(way) == pytest.approx(LIFTED * np.linalg.norm(along), rel=0.3)
    assert scenes["lifted"].probed.what == "held" and not scenes["lifted"].obstacles


@pytest.mark.campaign
def test_the_plane_starts_beside_the_body_and_goes_in(kidney):
    points, scenes = kidney
    (plane,) = scenes["pressed"].obstacles
    before, after = (plane.gap(points, t) for t in (0.0, scenes["pressed"].duration))
    depth = np.ptp(points @ plane.unit_normal)
    assert 0 < before.min() < 0.02 * depth
    assert after.min() == pytest.approx(-PRESSED_IN * depth, rel=0.2)


@pytest.mark.campaign
def test_the_scenes_differ_in_name_and_load_alone(kidney):
    scenes = kidney[1]
    assert tuple(scenes) == LOADS and [one.name for one in scenes.values()] == [f"kidney_{load}" for load in LOADS]
    assert len({str(one.organ) for one in scenes.values()}) == 1
    assert len({replace(one.reference, at_contact=0) for one in scenes.values()}) == 1


@pytest.mark.campaign
def test_finer_references_have_more_unknowns_and_nothing_else(kidney):
    """A plane touches many elements: none of them is halved beforehand."""
    for load, scene in kidney[1].items():
        assert refined(scene).reference == replace(scene.reference, most=FINE) != scene.reference
        assert (scene.reference.at_contact == 0) == (load != "probed")


def test_a_file_that_is_none_costs_its_own_rows(tmp_path, capsys):
    (tmp_path / "broken.stl").write_text("no mesh at all")
    assert main([str(tmp_path / "broken.stl"), "--root", str(tmp_path)]) == 0
    assert "broken.stl" in capsys.readouterr().out


@pytest.mark.campaign
@pytest.mark.parametrize(("name", "load", "force"), WITHIN)
def test_references_of_real_organs_can_judge(name, load, force, tmp_path, mesh_cache):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # thin margins warn
        scene = scan_scenes(real_surface(name))[load]
        reference = reference_of(tmp_path, scene)
    bars = reference.total_uncertainty
    assert bars["force_end"] < force and bars["surface_mean"] < 0.005
    assert row(scene, reference).startswith(scene.name)
