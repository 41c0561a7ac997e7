"""A folder of surfaces as a study: placed by rule, repaired, or refused with a reason."""

import warnings

import meshio
import numpy as np
import pytest

from massspring import ImplicitVolume
from studies.base.errors import StudyError
from studies.catalog.folder import placed_organs, study_on
from studies.catalog.study import Study
from studies.geometry import organ
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.library import KIDNEY_PROBE, STOMACH_PROBE
from studies.sweep.find_study import find_study

ONE = Study("base", "?", (Case(KIDNEY_PROBE, TetrahedralBody(nodes=150), ImplicitVolume()),), (), ("force_end",))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A kidney in millimetres, the same with a hole, text that is not a mesh, and a file of another kind."""
    place = tmp_path_factory.mktemp("organs")
    mesh = organ("kidney", 200, fill=False)
    for name, triangles in (("whole", mesh.triangles), ("open", mesh.triangles[9:])):
        meshio.write(place / f"{name}.ply", meshio.Mesh(1e3 * mesh.points, [("triangle", triangles)]))
    (place / "broken.stl").write_text("no mesh at all")
    (place / "notes.txt").write_text("read me")
    return place


@pytest.fixture(scope="module")
def placed(folder):
    return {one.path.name: one for one in placed_organs(folder, "mm")}


def test_each_file_is_placed_or_refused_with_a_reason(placed):
    assert set(placed) == {"broken.stl", "open.ply", "whole.ply"}
    assert placed["whole.ply"].scene is not None
    assert placed["broken.stl"].scene is None and "broken.stl" in placed["broken.stl"].words[0]
    assert placed["open.ply"].scene is None and "open at" in placed["open.ply"].words[0]


def test_a_placed_organ_is_held_at_one_end_and_touched_far_from_it(placed):
    scene = placed["whole.ply"].scene
    probe, points = scene.obstacles[0], organ("kidney", 200, fill=False).points
    nearest = np.linalg.norm(points - probe.centre, axis=1).min()
    assert probe.radius < nearest < probe.radius + 0.003
    held = points[scene.held[0].region.level(points) <= 0]
    assert 0.02 < len(held) / len(points) < 0.25
    assert np.linalg.norm(held - probe.centre, axis=1).min() > 0.4 * np.ptp(points, axis=0).max()


def test_the_study_asks_its_solid_recipes_of_every_organ(folder):
    study, placed = study_on(ONE, folder, "mm")
    assert [case.scene.name for case in study.cases] == ["whole"] and len(placed) == 3
    assert study.cases[0].body == ONE.cases[0].body and study.name.startswith("base-")


def test_it_has_a_name_that_every_command_understands(folder):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        study = find_study(f"bodies@{folder}:mm")
    assert {case.scene.name for case in study.cases} == {"whole"} and len(study.cases) == 4
    assert sum("is refused" in str(warning.message) for warning in caught) == 2


def test_what_is_no_folder_of_organs_is_refused(folder, tmp_path):
    with pytest.raises(StudyError, match="there is no folder"):
        find_study(f"accuracy@{tmp_path / 'gone'}")
    with pytest.raises(StudyError, match="has no surface"):
        study_on(ONE, tmp_path)
    with pytest.raises(StudyError, match="unit"):
        study_on(ONE, folder, "furlong")
    (tmp_path / "a.ply").write_text("")
    with pytest.raises(StudyError, match=r"no file in .* can be used; the first: a.ply"):
        study_on(ONE, tmp_path)
    hollow = Study("hollow", "?", (Case(STOMACH_PROBE),), (), ("force_end",))
    with pytest.raises(StudyError, match="needs hollow organs"):
        study_on(hollow, folder, "mm")
