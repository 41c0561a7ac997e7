"""The table of what methods support, held against `Setup`: what it allows runs, what it denies is refused with its
sentence; and docs/methods.md says the same."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array

from massspring import (
    METHODS,
    Clock,
    Event,
    MassSpringError,
    Plane,
    Probe,
    Ramp,
    Setup,
    Trajectory,
    Volumes,
    membrane_body,
    quadratic_body,
    simulate,
    tetrahedral_body,
)
from massspring.methods.capabilities import Capabilities
from studies.lab.methods_page import OPTIONS, methods_page
from tests.massspring.conftest import SOFT, block, body_of, hollow_block, icosphere
from tests.massspring.methods.test_methods import clock_for
from tests.massspring.quadratic import quadratic_block
from tests.massspring.rows import CONTESTANTS, KINDS, SUPPORTED, recovers

EACH = pytest.mark.parametrize("method", CONTESTANTS.values(), ids=CONTESTANTS.keys())
MANY, NO_TETRAHEDRA = "it keeps one volume, the body keeps", "the body has none; fill its mesh"
SHARE, LUMEN = "this body keeps part of that volume", "the body keeps a lumen too"
POINTS = "its volumes lie at points; take a quadratic body"
ELASTIC = {"points": POINTS, "elements": "its springs must have no length"}
REFUSED = {
    "block": {**ELASTIC},
    "ball": {"tetrahedra": NO_TETRAHEDRA, **ELASTIC},
    "hollow": {"whole": MANY, "tetrahedra": MANY, **ELASTIC},
    "regions": {"whole": MANY, "tetrahedra": MANY, **ELASTIC},
    "nodal": {"whole": MANY, "tetrahedra": MANY, **ELASTIC},
    "lumen": {"tetrahedra": LUMEN, **ELASTIC},
    "share": {"whole": SHARE, "tetrahedra": SHARE, **ELASTIC},
    "membrane": {"tetrahedra": NO_TETRAHEDRA, **ELASTIC},
    "prestressed": {"whole": "", "tetrahedra": "", "points": POINTS},
    "quadratic": {},
}
"""Kind of body -> what a method keeps -> words of the refusal."""
NEEDED = {
    "membrane": ("triangle_springs",),
    "prestressed": ("prestress",),
    "quadratic": ("prestress", "point_volumes", "facet_contact"),
}
"""Kind of body -> the capabilities that it needs, in the order in which they are checked."""


@pytest.fixture(params=REFUSED)
def kind(request):
    return request.param


@pytest.fixture
def any_body(kind, request):
    """Every kind of body there is."""
    return body_of_any(kind, request)


def body_of_any(kind, request):
    """The body of a kind of REFUSED."""
    if kind in KINDS:
        return body_of(kind, request)
    if kind == "membrane":
        return membrane_body(*icosphere(1), 0.003, SOFT, "delingette")
    if kind == "prestressed":
        taut = tetrahedral_body(*block((2, 2, 2)), SOFT, "cotangent")
        return taut.keeping(Volumes.nodal(taut))
    if kind == "quadratic":
        return quadratic_body(*quadratic_block((2, 2, 1)), SOFT)
    if kind == "lumen":
        hollow = request.getfixturevalue("hollow_body")
        inner = np.unique(hollow_block()[3])
        outer = hollow.triangles[~np.isin(hollow.triangles, inner).any(axis=1)]
        return hollow.keeping(Volumes.closed_surfaces(hollow, {"filled": outer}))
    whole = request.getfixturevalue("block_body")
    return whole.keeping(Volumes(("half",), whole.triangles, csr_array(np.full((1, len(whole.triangles)), 0.5))))


def block_for(method, request):
    """A block that the method advances."""
    kinds = {"points": "quadratic", "elements": "prestressed"}
    return body_of_any(kinds.get(method.capabilities.keeps, "block"), request)


def runs(setup) -> bool:
    history = simulate(setup)
    return history.outcome == "finished" and bool(np.isfinite(history.final).all())


@EACH
def test_a_body_runs_or_is_refused_with_the_sentence_of_the_table(method, kind, any_body):
    table = [getattr(method.capabilities, name) for name in NEEDED.get(kind, ())]
    denied = [support.because for support in table if not support]
    reason = denied[0] if denied else REFUSED[kind].get(method.capabilities.keeps)
    if reason is None and recovers(method) and not len(any_body.tetrahedra):
        reason = NO_TETRAHEDRA
    if reason is None:
        assert method.why_not(any_body) is None
        assert runs(Setup(any_body, method, clock_for(any_body, 1, 2, method=method)))
    else:
        assert reason in method.why_not(any_body)
        with pytest.raises(MassSpringError, match=f"method '{method.name}' does not apply to this body: .*{reason}"):
            Setup(any_body, method, Clock(0.01, 1, 10))


REQUESTS = {
    "thin_probes": (
        {"obstacles": (Probe((0.0, 0.0, 1.0)),)},
        r"method '{}' does not support thin probes \(obstacle 0\): {};",
    ),
    "targets": ({"targets": {"whole": Ramp((0.0, 1e3), (1.0, 1.1))}}, "which method '{}' does not follow: {};"),
    "face_contact": (
        {"pairs": np.zeros((0, 2), dtype=int)},
        "method '{}' does not support contact between the faces of a cut: {};",
    ),
    "float32": ({"precision": "float32"}, "method '{}' runs in float64 only, {};"),
    "events": ({"events": ()}, "method '{}' supports no body that changes in a run: {}"),
}
"""Capability -> the options of `Setup` that ask for it, and its refusal."""


@EACH
@pytest.mark.parametrize("option", REQUESTS)
def test_an_option_runs_or_is_refused_with_the_sentence_of_the_table(method, option, request):
    options, sentence = REQUESTS[option]
    body = block_for(method, request)
    if "targets" in options:
        options = {"targets": {body.kept.names[0]: options["targets"]["whole"]}}
    if "events" in options:
        options = {"events": (Event(body, np.arange(body.node_count), np.arange(body.kept.count), 1),)}
    clock, supported = clock_for(body, 2, 2, method=method), getattr(method.capabilities, option)
    if supported:
        assert runs(Setup(body, method, clock, **options))
    else:
        with pytest.raises(MassSpringError, match=sentence.format(method.name, supported.because)):
            Setup(body, method, clock, **options)


@EACH
def test_every_method_supports_friction(method, request):
    """A rough plane that presses and slides drags the body along."""
    body = block_for(method, request)
    clock = clock_for(body, 5, 10, method=method)
    top = float(body.rest[:, 2].max())
    way = Trajectory((0.0, clock.duration), ((0.0, 0.0, 0.0), (0.002, 0.0, -0.002)))
    setup = Setup(body, method, clock, (Plane((0, 0, top), (0, 0, -1), way, friction=0.5),))
    drag = simulate(setup).contact_force.sum(axis=0)[0]
    assert drag[2] < 0 and 0.05 * -drag[2] < drag[0] <= 0.5 * -drag[2] * 1.01


def test_every_capability_has_a_request_here():
    assert set(OPTIONS) == set(REQUESTS) | {name for names in NEEDED.values() for name in names}
    assert set(KINDS) <= set(REFUSED)
    for keeps, kinds in SUPPORTED.items():
        assert set(kinds) == {kind for kind in KINDS if keeps not in REFUSED[kind]}


def test_settings_that_support_something_else_say_so_for_themselves_alone():
    """The table of an instance, of its copies and never of its class."""
    whole = CONTESTANTS["xpbd_whole"]
    assert whole.capabilities.keeps == replace(whole, iterations=2).capabilities.keeps == "whole"
    assert type(whole).capabilities.keeps == replace(whole, volumes="element").capabilities.keeps == "tetrahedra"
    assert all(isinstance(method.capabilities, Capabilities) for method in METHODS)


def test_the_page_of_the_docs_is_the_table():
    page = Path(__file__).parents[3] / "docs" / "methods.md"
    assert page.read_text(encoding="utf-8") == methods_page(), "run python -m studies.lab.methods_page"
