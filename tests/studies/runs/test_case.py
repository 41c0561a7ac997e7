"""A case is its key: what is stored is what was meant, and no typo is read as something else."""

import json
from dataclasses import replace

import pytest

from massspring import METHODS, Element, Free, ImplicitVolume, Penalty, Xpbd
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.runs.case import BodyRecipe, Case, case_from_json, case_to_dict
from studies.scene.library import SCENES
from tests.studies.tiny import tiny_case

CHANGES = {
    "scene": {"scene": SCENES[1]},
    "damping": {"scene": replace(SCENES[0], damping=41.0)},
    "tissue": {"scene": replace(SCENES[0], tissue=replace(SCENES[0].tissue, shear_modulus=1801.0))},
    "obstacle": {"scene": replace(SCENES[0], obstacles=SCENES[0].obstacles[:1])},
    "checkpoint": {"scene": replace(SCENES[0], checkpoints=(1.0, 4.0))},
    "kind": {"body": BodyRecipe("surface")},
    "nodes": {"body": BodyRecipe(nodes=551)},
    "law": {"body": BodyRecipe(law="uniform")},
    "weights": {"body": BodyRecipe("surface", weights=(1.0, 0.5, 0.25, 1.0))},
    "stiffness": {"body": BodyRecipe(stiffness=1.01)},
    "quadratic": {"body": BodyRecipe("quadratic")},
    "graded": {"body": BodyRecipe(graded=True)},
    "mass": {"body": BodyRecipe("quadratic", graded=True, mass="stiffness")},
    "cut": {"body": BodyRecipe(cut="virtual")},
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
        Case(scene, BodyRecipe("surface", 80, stiffness=2.5), method(), 1e-3, 0.7, 12, precision=precision),
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


def test_names_are_readable_and_distinct_within_a_study():
    for study in STUDIES:
        names = [case.name for case in study.cases]
        assert len(set(names)) == len(names)
    assert Case(SCENES[0]).name == "ball_squeeze-tetrahedral-550-implicit_volume-dt0.5"
    other = Case(SCENES[0], BodyRecipe(law="uniform", stiffness=4.0), Free(), dt=2e-3)
    assert other.name == "ball_squeeze-tetrahedral-550-free-dt2ms-uniform-k4"
    weighted = Case(SCENES[0], BodyRecipe("surface", weights=(1.0, 0.5, 0.25, 1.0)), Free())
    assert weighted.name == "ball_squeeze-surface-550-free-dt0.5-w1_0.5_0.25_1"


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


def test_a_setting_that_is_not_chosen_leaves_old_keys_as_they_were():
    """The key of the first scene's default case as it was before surface weights could be chosen."""
    assert "weights" not in json.loads(Case(SCENES[0]).key)["body"]
    assert "precision" not in json.loads(Case(SCENES[0]).key)
    assert not {"graded", "mass", "cut"} & set(json.loads(Case(SCENES[0]).key)["body"])
    assert set(json.loads(Case(SCENES[0]).key)["method"]["settings"]) == {"tolerance", "most_iterations"}
    assert json.loads(Case(SCENES[0], method=ImplicitVolume(recovers=True)).key)["method"]["settings"]["recovers"]


def test_grading_and_masses_stand_in_names_and_series():
    assert Case(SCENES[0], BodyRecipe(graded=True)).name == "ball_squeeze-tetrahedral-550-implicit_volume-dt0.5-graded"
    body = BodyRecipe("quadratic", 800, graded=True, mass="stiffness")
    assert Case(SCENES[0], body).name == "ball_squeeze-quadratic-800-implicit_volume-dt0.5-graded-stiffness_mass"
    assert body.series == "graded quadratic, masses by stiffness"
    assert BodyRecipe(volumes="nodal", graded=True).series == "graded tetrahedral, nodal volumes"
    virtual = Case(SCENES[0], BodyRecipe(cut="virtual"))
    assert virtual.name == "ball_squeeze-tetrahedral-550-implicit_volume-dt0.5-virtual_nodes"
    assert virtual.body.series == "tetrahedral, virtual nodes"


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        ({"kind": "surface", "graded": True}, "a surface body cannot be graded; choose kind 'tetrahedral' or"),
        ({"kind": "membrane", "law": "delingette", "graded": True}, "a membrane body cannot be graded"),
        ({"mass": "stiffness"}, "a tetrahedral body has no masses by stiffness; choose kind 'quadratic'"),
        ({"kind": "quadratic", "cut": "virtual"}, "a quadratic body is not cut by virtual nodes; choose kind"),
        ({"kind": "quadratic", "volumes": "regions"}, "one volume per vertex, not volumes 'regions'; leave"),
        ({"kind": "quadratic", "law": "uniform"}, "follow no law, not 'uniform' either; leave the law out"),
    ],
)
def test_settings_of_a_body_that_do_not_go_together_are_refused(recipe, message):
    with pytest.raises(StudyError, match=message):
        BodyRecipe(**recipe)


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


@pytest.mark.parametrize("text", ["", "{", "[]", "3", "null", '"case"', "{}", '{"scene": 3}'])
def test_malformed_text_is_refused(text):
    with pytest.raises(StudyError, match="not a stored case"):
        case_from_json(text)


@pytest.mark.parametrize(
    "bad", [{"dt": 0.0}, {"dt": -1e-3}, {"dt": float("nan")}, {"dt": "fast"}, {"dt_fraction": -0.5}, {"frames": 0}]
)
def test_a_case_without_a_clock_cannot_be_made(bad):
    (name,) = bad
    with pytest.raises(StudyError, match=rf"{name} is .*; "):
        Case(SCENES[0], method=ImplicitVolume(), **bad)


def test_settings_of_a_method_that_are_not_its_defaults_stand_in_the_name():
    assert Case(SCENES[0], method=Element(bulk_modulus=1e6, hard=True)).name.endswith("-bulk_modulus1e+06-hard")
    assert Case(SCENES[0], method=Xpbd("whole", iterations=2)).name.endswith("-whole-iterations2")
    assert Case(SCENES[0], method=Xpbd()).name == "ball_squeeze-tetrahedral-550-xpbd-dt0.5"
