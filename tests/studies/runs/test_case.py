"""A case is its key: what is stored is what was meant, and no typo is read as something else."""

import json
import re
from dataclasses import replace

import pytest

from massspring import METHODS, Element, Free, Penalty, Xpbd
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.runs.case import Case, case_from_json, case_to_dict
from studies.runs.recipes import (
    BODIES,
    BodyRecipe,
    MembraneBody,
    QuadraticBody,
    SurfaceBody,
    TetrahedralBody,
    recipe_from_dict,
)
from studies.scene.library import SCENES
from tests.studies.tiny import tiny_case

CHANGES = {
    "scene": {"scene": SCENES[1]},
    "damping": {"scene": replace(SCENES[0], damping=41.0)},
    "tissue": {"scene": replace(SCENES[0], tissue=replace(SCENES[0].tissue, shear_modulus=1801.0))},
    "obstacle": {"scene": replace(SCENES[0], obstacles=SCENES[0].obstacles[:1])},
    "checkpoint": {"scene": replace(SCENES[0], checkpoints=(1.0, 4.0))},
    "kind": {"body": SurfaceBody()},
    "nodes": {"body": TetrahedralBody(nodes=551)},
    "law": {"body": TetrahedralBody(law="uniform")},
    "weights": {"body": SurfaceBody(weights=(1.0, 0.5, 0.25, 1.0))},
    "stiffness": {"body": TetrahedralBody(stiffness=1.01)},
    "quadratic": {"body": QuadraticBody()},
    "graded": {"body": TetrahedralBody(graded=True)},
    "own volumes": {"body": QuadraticBody(volumes="mixed")},
    "mass": {"body": QuadraticBody(graded=True, mass="stiffness")},
    "cut": {"body": TetrahedralBody(cut="virtual")},
    "method": {"method": Free()},
    "dt": {"dt": 1e-4},
    "dt_fraction": {"dt_fraction": 0.51},
    "frames": {"frames": 801},
    "precision": {"precision": "float32"},
}
ALL_CASES = [case for study in STUDIES for case in study.cases]


def changed(edit) -> str:
    """The key of a case after `edit` of its JSON-able form."""
    data = case_to_dict(tiny_case())
    edit(data)
    return json.dumps(data)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_key_read_back_is_the_same_case(scene, method):
    precision = "float32" if method().capabilities.float32 else "float64"
    for case in (
        Case(scene, method=method()),
        Case(scene, SurfaceBody(80, stiffness=2.5), method(), 1e-3, 0.7, 12, precision=precision),
    ):
        again = case_from_json(case.key)
        assert again == case
        assert again.key == case.key


def test_every_case_of_the_catalogue_can_be_replayed():
    assert all(case_from_json(case.key) == case.replaced(timed=False) for case in ALL_CASES)


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_any_change_changes_the_key(change):
    case = Case(SCENES[0])
    assert case.replaced(**change).key != case.key
    assert case_from_json(case.replaced(**change).key) == case.replaced(**change)


def test_measuring_time_changes_no_physics():
    assert tiny_case(timed=True).key == tiny_case(timed=False).key


NAMES = {
    "tetrahedral-550-implicit_volume-dt0.5": {},
    "tetrahedral-550-free-dt2ms-uniform-k4": {
        "body": TetrahedralBody(law="uniform", stiffness=4.0),
        "method": Free(),
        "dt": 2e-3,
    },
    "surface-550-free-dt0.5-w1_0.5_0.25_1": {"body": SurfaceBody(weights=(1.0, 0.5, 0.25, 1.0)), "method": Free()},
    "tetrahedral-550-implicit_volume-dt0.5-graded": {"body": TetrahedralBody(graded=True)},
    "quadratic-800-implicit_volume-dt0.5-graded-stiffness_mass": {
        "body": QuadraticBody(800, graded=True, mass="stiffness")
    },
    "tetrahedral-550-implicit_volume-dt0.5-virtual_nodes": {"body": TetrahedralBody(cut="virtual")},
    "tetrahedral-550-element-dt0.5-bulk_modulus1e+06-hard": {"method": Element(bulk_modulus=1e6, hard=True)},
    "tetrahedral-550-xpbd-dt0.5-whole-iterations2": {"method": Xpbd("whole", iterations=2)},
    "tetrahedral-550-xpbd-dt0.5": {"method": Xpbd()},
}
SERIES = {
    "graded quadratic, masses by stiffness": QuadraticBody(800, graded=True, mass="stiffness"),
    "quadratic, mixed volumes": QuadraticBody(volumes="mixed"),
    "graded tetrahedral, nodal volumes": TetrahedralBody(volumes="nodal", graded=True),
    "tetrahedral, virtual nodes": TetrahedralBody(cut="virtual"),
}


def test_names_are_readable_and_distinct_within_a_study():
    for study in STUDIES:
        names = [case.name for case in study.cases]
        assert len(set(names)) == len(names)
    assert {Case(SCENES[0], **settings).name: settings for settings in NAMES.values()} == {
        f"ball_squeeze-{name}": settings for name, settings in NAMES.items()
    }
    assert {body.series: body for body in SERIES.values()} == SERIES


@pytest.mark.parametrize(
    ("method", "precision", "message"),
    [
        (Free(), "float16", "unknown precision 'float16'; choose float64 or float32"),
        (Penalty(), "float32", "method 'penalty' runs in float64 only, its claims are measured in float64; leave"),
    ],
)
def test_a_precision_that_the_method_does_not_claim_is_refused(method, precision, message):
    with pytest.raises(StudyError, match=message):
        Case(SCENES[0], method=method, precision=precision)


# What release 0.3 wrote for every kind, and what it left out where it was the default.
SHARED = {"nodes": 80, "law": "van_gelder", "stiffness": 1.0, "volumes": "scene", "regions": 26, "axis": "straight"}
LEFT_OUT = {"weights": None, "graded": False, "mass": "lumped", "contact": "facets", "cut": "conforming"}


@pytest.mark.parametrize("more", [{}, LEFT_OUT], ids=["short", "long"])
@pytest.mark.parametrize("kind", ["tetrahedral", "surface", "quadratic"])
def test_a_recipe_of_release_0_3_is_read(kind, more):
    old = SHARED | more | {"kind": kind}
    assert recipe_from_dict(old) == (TetrahedralBody(80, regions=26) if kind == "tetrahedral" else BODIES[kind](80))
    assert recipe_from_dict(old | {"stiffness": 2.0}).stiffness == 2.0
    with pytest.raises(StudyError, match="has no setting 'sides'"):
        recipe_from_dict(old | {"sides": 3})
    assert BodyRecipe(kind, 80) == BODIES[kind](80)
    if kind != "tetrahedral":
        with pytest.raises(StudyError, match=f"a {kind} body has no setting 'law'"):
            recipe_from_dict(old | {"law": "uniform"})


@pytest.mark.parametrize(
    ("kind", "settings", "message"),
    [
        (BodyRecipe, {"kind": "quadratics"}, "unknown kind of body 'quadratics'; did you mean 'quadratic'"),
        (
            SurfaceBody,
            {"graded": True},
            "no setting 'graded'; it has nodes, stiffness, axis, weights",
        ),
        (MembraneBody, {"volumes": "nodal"}, "a membrane body has no setting 'volumes'"),
        (
            MembraneBody,
            {"law": "uniform"},
            "law of a membrane 'uniform'; known are delingette, lloyd",
        ),
        (TetrahedralBody, {"law": "van_geldr"}, "unknown stiffness law 'van_geldr'; did you mean 'van_gelder'"),
        (TetrahedralBody, {"mass": "stiffness"}, "a tetrahedral body has no setting 'mass'"),
        (TetrahedralBody, {"graded": "adaptive"}, "not graded by a solution; take a QuadraticBody"),
        (TetrahedralBody, {"volumes": "mixed"}, "volumes 'mixed' are of quadratic elements; take a QuadraticBody, or"),
        (QuadraticBody, {"volumes": "nodal"}, "volumes of a quadratic body 'nodal'; known are element, mixed, vertex"),
        (QuadraticBody, {"cut": "virtual"}, "a quadratic body has no setting 'cut'"),
        (QuadraticBody, {"law": "uniform"}, "a quadratic body has no setting 'law'"),
    ],
)
def test_a_setting_of_another_kind_is_refused(kind, settings, message):
    with pytest.raises(StudyError, match=message):
        kind(**settings)


UNREADABLE = {
    "method": (lambda d: d["method"].update(name="implicit_volumes"), "did you mean 'implicit_volume'"),
    "setting": (lambda d: d["method"]["settings"].update(alpha=1.0), "no setting alpha"),
    "recipe": (lambda d: d["body"].update(noodles=3), "noodles"),
    "kind": (lambda d: d["body"].update(kind="jelly"), "kind"),
    "scene": (lambda d: d["scene"].update(dampping=3.0), "dampping"),
    "tissue": (lambda d: d["scene"]["tissue"].update(viscosity=3.0), "scene.tissue.viscosity"),
    "obstacle": (lambda d: d["scene"]["obstacles"][1].update(bounce=0.3), "bounce"),
    "organ missing": (lambda d: d["scene"].pop("organ"), "organ"),
    "normal": (lambda d: d["scene"]["obstacles"][0].update(normal=[0, 0, 0]), "direction"),
    "dt missing": (lambda d: d.pop("dt"), "dt"),
    "dt word": (lambda d: d.update(dt="fast"), "dt is 'fast'"),
    "dt negative": (lambda d: d.update(dt=-1e-3), "dt is -0.001"),
    "dt NaN": (lambda d: d.update(dt=float("nan")), "dt is nan"),
    "fraction": (lambda d: d.update(dt_fraction=0.0), "dt_fraction is 0.0"),
    "frames": (lambda d: d.update(frames=0), "frames is 0"),
    "extra": (lambda d: d.update(colour="red"), "unknown setting colour"),
}


@pytest.mark.parametrize(("edit", "named"), UNREADABLE.values(), ids=UNREADABLE)
def test_what_no_one_would_read_is_refused_by_name(edit, named):
    with pytest.raises(StudyError, match=named) as caught:
        case_from_json(changed(edit))
    assert "\n" not in str(caught.value)


def test_a_method_of_release_0_3_is_read():
    """Without the settings that it left out where they were the default."""
    data = json.loads(Case(SCENES[0]).key)
    del data["method"]["settings"]["recovers"]
    assert case_from_json(json.dumps(data)) == Case(SCENES[0])


@pytest.mark.parametrize("text", ["", "{", "[]", "3", "null", '"case"', "{}", '{"scene": 3}'])
def test_malformed_text_is_refused(text):
    with pytest.raises(StudyError, match="not a stored case"):
        case_from_json(text)


SETTINGS = {
    "stiffness is inf": lambda: TetrahedralBody(150, stiffness=float("inf")),
    "stiffness is 'hard'": lambda: TetrahedralBody(150, stiffness="hard"),
    "stiffness is -1": lambda: TetrahedralBody(150, stiffness=-1),
    "nodes is nan": lambda: SurfaceBody(float("nan")),
    "weights are 'abcd'": lambda: SurfaceBody(150, weights="abcd"),
    "weights are (1, 1, inf, 1)": lambda: SurfaceBody(150, weights=(1, 1, float("inf"), 1)),
}


@pytest.mark.parametrize("sentence", SETTINGS)
def test_settings_of_a_body_are_finite_numbers(sentence):
    with pytest.raises(StudyError, match=re.escape(sentence)):
        tiny_case(body=SETTINGS[sentence]())
