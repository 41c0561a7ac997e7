"""An answer as lines for people: the recipe, its errors with their uncertainty, its cost, how to run it again."""

from studies.catalog.accuracy import ACCURACY
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
from studies.metrics.cells import MISSING, value_cell
from studies.metrics.interval import OF_100, untested
from studies.metrics.judged import Judged, Measured
from studies.metrics.wish import Wish
from studies.runs.case import Case
from studies.runs.recipes import BodyRecipe
from studies.scene.library import SCENES
from studies.tools.advise.answer import Advice
from studies.tools.advise.population import words as others

LABEL = 14
"""Width of the first column [letters]."""


def lines_of(answer: Advice) -> list[str]:
    verdict = [f"{answer.scene.name}: {wish_words(answer.wish)}{USUAL if answer.usual else ''}", *_verdict(answer)]
    return verdict if answer.chosen is None else [*verdict, *_recipe(answer, answer.chosen)]


USUAL = " (default target; --force and --displacement set another)"


def wish_words(wish: Wish) -> str:
    """ "force within 3 %, displacement within 1 %, 1 ms of computing per 1 ms of simulated time"."""
    bounds = {"force": wish.force, "displacement": wish.displacement}
    parts = [f"{name} within {bound:.3g} %" for name, bound in bounds.items() if bound is not None]
    if wish.budget is not None:
        parts.append(f"at most {wish.budget:.3g} ms of computing per 1 ms of simulated time")
    return ", ".join(parts)


def _verdict(answer: Advice) -> list[str]:
    lines = [f"{' and '.join(answer.ignored)} ignored: the scene does not compare it"] if answer.ignored else []
    one, wish = answer.chosen, answer.wish
    if answer.misshapen is not None:
        body = answer.misshapen.case.body
        lines.append(
            f"not recommended: {body.series}, {body.nodes:,} surface nodes, meets the target, but "
            f"{off_shape(answer.misshapen)}"
        )
    if answer.alike:
        *others, last = answer.alike
        those = f"the worst of {', '.join(others)} and {last}" if others else f"those of {last}"
        lines.append(
            f"no run of this scene is stored: errors, shape and step are {those}, loaded in the same way; "
            "`organbench run` estimates the errors in this one"
        )
    if answer.beyond:
        lines.append(f"its loads are larger than any with which errors were measured: {answer.beyond}")
    for name in answer.unknowable:
        uncertainty = max(getattr(row, name).uncertainty for group in answer.stored.cases.values() for row in group)
        lines.append(f"undecided: the reference is only known to ±{uncertainty:.2g} % of the {name}")
    if one is None:
        return [*lines, "no recommendation: name an error that the scene compares"]
    if answer.meets:
        return [*lines, *_borderline(one, wish)]
    shares = {name: share for name, share in one.shares(wish).items() if share > 1.0}
    if shares:
        words = [f"{name} {share:.2g} times too large" for name, share in shares.items() if name not in one.off_shape]
        missed = ", ".join([*words, off_shape(one)] if one.off_shape else words)
        return [*lines, f"no body meets it; the closest candidate is ({missed}):"]
    if answer.beyond:
        return [*lines, "its errors are not known; of smaller loads those of the closest candidate are:"]
    blind = (
        "its computing time is not known on this machine"
        if not one.cost.known
        else "measured against it, the closest candidate is:"
    )
    return [*lines, blind]


def off_shape(one: Judged) -> str:
    """What a body beyond the bounds of the shape lacks: "it is up to 10 % of the liver's size away from the true shape
    and lacks 2.4 % of its volume (allowed: 1 and 0.5 %)"."""
    organ = one.case.scene.organ.shape
    name = "organ" if organ == "file" else organ
    parts = [f"is up to {value_cell(one.shape.value)} % of the {name}'s size away from the true shape"]
    if one.shape_volume.known:
        verb = "lacks" if one.shape_volume.value < 0.0 else "has"
        more = "of its volume" if one.shape_volume.value < 0.0 else "too much volume"
        parts.append(f"{verb} {value_cell(abs(one.shape_volume.value))} % {more}")
    return f"it {' and '.join(parts)} (allowed: {SHAPE:g} and {SHAPE_VOLUME:g} %)"


def _shape(one: Judged) -> str:
    if not one.shape.known:
        return "not measured"
    volume = f", volume {_error(one.shape_volume, True)}" if one.shape_volume.known else ""
    return f"{_error(one.shape)} of the organ's size at most{volume}"


def _borderline(one: Judged, wish: Wish) -> list[str]:
    """A remark where the uncertainty of an error reaches beyond the wish."""
    near = [
        name
        for name in ("force", "displacement")
        if (bound := getattr(wish, name)) is not None
        and (error := getattr(one, name)).known
        and abs(error.value) + error.uncertainty > bound
    ]
    return [f"the uncertainty of the reference reaches beyond the target ({' and '.join(near)})"] if near else []


def _recipe(answer: Advice, one: Judged) -> list[str]:
    case = one.case
    step = f", {1e3 * one.dt:.3g} ms" if one.dt == one.dt else ""
    rows = {
        "recipe": f"{case.body.series}, {case.body.nodes:,} surface nodes, dt = {case.dt_fraction:g} dt_c{step}",
        "force": _error(one.force, not one.bounds) + _meshes(one, "force"),
        "displacement": f"{_error(one.displacement)} (mean over the true surface, of the largest)"
        + _meshes(one, "displacement"),
        "shape": _shape(one),
        "computing": _computing(answer, one),
        "measured in": answer.stored.where,
        "again": _command(answer, case),
        "in Python": in_python(case),
    }
    if answer.unseen is not None:
        rows["others"] = others(answer.unseen)
    return [f"  {name:<{LABEL}}{words}" for name, words in rows.items()]


def _meshes(one: Judged, name: str) -> str:
    if not getattr(one, name).known:
        return ""
    if one.bounds:
        within = f", which {OF_100} of 100 such bodies stay within, by two meshes without a reference"
        return "; ".join(filter(None, (within, untested(one.case.scene))))
    if not one.members:
        return ", on one mesh: neighbouring meshes may differ several times"
    scenes = {mesh.case.scene.name for mesh in one.members}
    of_scenes = f" of {len(scenes)} scenes" if len(scenes) > 1 else ""
    return f", the largest of {len(one.members)} neighbouring meshes{of_scenes}; median {one.median(name):.2g} %"


def _error(error: Measured, signed: bool = False) -> str:
    if not error.known:
        return f"{MISSING} not compared"
    return f"{value_cell(error.value, error.uncertainty, signed=signed)} %"


def _computing(answer: Advice, one: Judged) -> str:
    if not one.cost.known:
        return "not known; leave out --no-timing to measure it here"
    spread = f" ± {one.cost.uncertainty:.1g}" if one.cost.uncertainty == one.cost.uncertainty else ""
    own = f" ({one.processor_cost.value:.3g} of processor time)" if one.processor_cost.known else ""
    text = (
        f"{one.cost.value:.3g}{spread} ms{own} per 1 ms of simulated time, {1.0 / one.cost.value:.3g} times real time"
    )
    text += f", disturbed ({one.disturbed})" if one.disturbed else ""
    machine = f"{'this' if one.timed_here else 'another'} machine{one.processor and f' ({one.processor})'}"
    if answer.short is not None:
        whole = answer.scene.duration
        return f"{text}, on {machine}, timed over the first {answer.short.covered:.2g} of {whole:g} s"
    return f"{text}, on {machine}"


def _command(answer: Advice, case: Case) -> str:
    if answer.alike:
        return "the line below with `measure` of studies: no stored study has this scene"
    study = answer.stored.study
    return f"organbench run {study if study == ACCURACY.name else 'FILE.py'} --case {case.name}"


def in_python(case: Case) -> str:
    """The case as it is written down: "Case(LIVER_PRESS, QuadraticBody(nodes=794), dt_fraction=0.8)"."""
    scene = case.scene.name.upper() if case.scene in SCENES else "scene"
    return f"Case({scene}, {body_in_python(case.body)}, dt_fraction={case.dt_fraction:g})"


def body_in_python(body: BodyRecipe) -> str:
    """ "QuadraticBody(nodes=794)"."""
    usual = vars(type(body)())
    chosen = [f"{name}={value!r}" for name, value in vars(body).items() if value != usual[name]]
    return f"{type(body).__name__}({', '.join(chosen)})"
