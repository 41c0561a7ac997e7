"""The frozen set agrees with the code, and scenes that it holds back cannot be guessed or entered."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.catalog.population.draw import member
from studies.exchange.league.frozen import FILE, frozen
from studies.exchange.meshes import given_mesh
from studies.reference.published import physics, published
from studies.scene.library import BALL_SQUEEZE, SCENES
from studies.scene.scene import Scene

OPEN = {name: one for name, one in frozen().items() if not one.held_back}
HELD = {name: one for name, one in frozen().items() if one.held_back}


def test_five_scenes_are_open_and_three_held_back():
    assert len(OPEN) == 5 and len(HELD) == 3
    assert set(OPEN) <= {scene.name for scene in SCENES} and not set(HELD) & {scene.name for scene in SCENES}


@pytest.mark.parametrize("name", frozen())
def test_every_scene_has_the_hashes_of_its_reference_and_its_meshes(name):
    one = frozen()[name]
    assert {key.split("-")[0] for key in one.meshes} == {"straight", "curved"}
    for digest in (one.reference, one.physics, *one.meshes.values()):
        assert re.fullmatch("[0-9a-f]{64}", digest)
    assert len(set(one.meshes.values())) == len(one.meshes)


def test_no_two_scenes_share_a_reference_or_physics():
    for kind in ("reference", "physics"):
        assert len({getattr(one, kind) for one in frozen().values()}) == len(frozen())


def test_what_is_held_back_is_not_in_the_set():
    """Hashes alone: neither a seed nor a load."""
    data = json.loads(FILE.read_text())
    assert all(set(one) == {"reference", "physics", "meshes"} for one in data["held back"].values())


@pytest.mark.parametrize("scene", [one for one in SCENES if one.name in OPEN], ids=lambda one: one.name)
def test_open_scenes_are_judged_by_the_references_that_the_set_names(scene: Scene):
    reference = published(scene)
    assert reference is not None and reference.sha256 == OPEN[scene.name].reference
    assert physics(scene) == OPEN[scene.name].physics


def test_no_member_with_a_small_seed_is_held_back():
    """The usual seeds give none of them."""
    hashes = {one.physics for one in HELD.values()}
    drawn = [member(organ, seed, 0) for organ in ("liver", "kidney") for seed in (*range(4), 2026, 2027)]
    assert not hashes & {physics(scene) for scene in drawn}


@pytest.mark.parametrize("kind", ["straight", "curved"])
def test_this_machine_makes_the_mesh_of_the_set(mesh_cache, kind):
    assert given_mesh(BALL_SQUEEZE, 150, kind).digest == OPEN["ball_squeeze"].meshes[f"{kind}-150"]


def test_a_digest_ignores_rounding_and_nothing_else(mesh_cache):
    mesh = given_mesh(BALL_SQUEEZE, 150, "straight")
    organ = mesh.mesh
    noise = 1e-15 * np.random.default_rng(1).normal(size=organ.points.shape)
    assert replace(mesh, mesh=replace(organ, points=organ.points + noise)).digest == mesh.digest
    for wrong in (2e-7, -2e-7):
        moved = organ.points.copy()
        moved[7, 1] += wrong
        assert replace(mesh, mesh=replace(organ, points=moved)).digest != mesh.digest
    swapped = organ.tetrahedra.copy()
    swapped[[0, 1]] = swapped[[1, 0]]
    assert replace(mesh, mesh=replace(organ, tetrahedra=swapped)).digest != mesh.digest


def test_a_damaged_set_is_refused(tmp_path):
    file = tmp_path / "OB.json"
    file.write_text(json.dumps({"open": {"ball_squeeze": {"reference": "0"}}}))
    with pytest.raises(StudyError, match=r"the frozen set OB.json cannot be read \('physics'\)"):
        frozen(file)
