"""Frames of every method in every form that is compiled apart, on tiny bodies: derived from what methods support."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from massspring import (
    LITERATURE,
    METHODS,
    Attachment,
    Clock,
    Method,
    Plane,
    Probe,
    Setup,
    Trajectory,
    simulate,
    step_limit,
)
from massspring.body.body import NO_FACETS
from massspring.methods import VARIANTS
from massspring.run.precision import Precision
from massspring.world.obstacles import Surroundings
from studies.sweep.compiling.bodies import EDGE, KINDS, tiny_body

FRAMES, STEPS = 2, 2
PLAIN, PROBE = "", "thin probe"
OWN_TYPES = ("whole", "several", "quadratic")
"""Kinds of bodies whose types are not those of another. Options are compiled for them in double precision, of a method
that keeps nothing for one of them. The rest is compiled when it is asked for."""


@dataclass(frozen=True)
class Variant:
    """A frame loop with the types that it is compiled for."""

    method: Method
    kind: str
    precision: Precision = "float64"
    option: str = PLAIN

    @property
    def name(self) -> str:
        default, settings = type(self.method)(), fields(self.method)  # pyright: ignore[reportArgumentType]
        values = {field.name: getattr(self.method, field.name) for field in settings}
        changed = [f"{name}={value}" for name, value in values.items() if value != getattr(default, name)]
        return ", ".join(filter(None, (self.method.name, *changed, self.kind, self.precision, self.option)))


def variants() -> list[Variant]:
    """All: plain ones first, they compile the kernels that the others share; last the bodies that share their types.

    Two processes that do neighbours at once would otherwise both compile the same. So the first variant of each family
    comes before the second of any.
    """
    methods = (*(method() for method in (*METHODS, *LITERATURE)), *VARIANTS)
    all_variants = [variant for method in methods for variant in variants_of(method)]
    all_variants.sort(key=lambda one: (one.kind not in OWN_TYPES, one.option != PLAIN, _rank(one.method)))
    first: dict[tuple[str, ...], Variant] = {}
    for one in all_variants:
        first.setdefault((family(one.method), one.precision, one.option), one)
    begin = set(first.values())
    return sorted(all_variants, key=lambda one: (one.kind not in OWN_TYPES, one.option != PLAIN, one not in begin))


def variants_of(method: Method) -> Iterator[Variant]:
    """Those of a method: each body that it advances in each precision, and each option that it supports."""
    table = method.capabilities
    precisions: tuple[Precision, ...] = ("float64", "float32") if table.float32 else ("float64",)
    for kind in KINDS:
        if method.why_not(tiny_body(kind)) is not None:
            continue
        thin_probes = table.thin_probes and kind != "quadratic"  # beside which they are refused
        own = kind == "whole" if table.keeps == "none" else kind in OWN_TYPES or table.keeps == "elements"
        for precision in precisions:
            yield Variant(method, kind, precision)
        if own and thin_probes:
            yield Variant(method, kind, option=PROBE)


def family(method: Method) -> str:
    """Equal for methods that one compiled loop advances: its module in massspring.methods.families, else theirs."""
    advance = type(method).advance
    used = [advance.__globals__.get(name) for name in advance.__code__.co_names]
    modules = [getattr(one, "__module__", None) or "" for one in used]
    return next((module for module in modules if ".families." in module), type(method).__module__)


def _rank(method: Method) -> int:
    """The method that shares most with others comes first."""
    return ("several", "whole", "tetrahedra", "points", "elements", "none").index(method.capabilities.keeps)


def advance(variant: Variant) -> None:
    """Some frames of the variant: a plane presses the body, which is held below; a rough one where the method can."""
    simulate(setup_of(variant))


def setup_of(variant: Variant) -> Setup:
    """The body, held at its lowest nodes, under a plane that comes down by 2 % of its height."""
    body, method = tiny_body(variant.kind), variant.method
    if variant.precision == "float32":
        body = replace(body, contact_facets=NO_FACETS)  # inside which contact runs in float64 only; the types are equal
    dt = 0.25 * step_limit(body, added=method.added_stiffness(body)).undamped
    clock = Clock(STEPS * dt, FRAMES, STEPS)
    down = Trajectory((0.0, clock.duration), ((0.0, 0.0, 0.0), (0.0, 0.0, -0.02 * EDGE)))
    plane = Plane((0.0, 0.0, EDGE), (0.0, 0.0, -1.0), down, friction=0.3)
    if method.why_not_among(Surroundings((plane,), attachments=1)):
        plane = replace(plane, friction=0.0)
    probes = (Probe((0.0, 0.0, 10 * EDGE)),) if variant.option == PROBE else ()
    held = Attachment(np.flatnonzero(body.rest[:, 2] < 1e-9))
    return Setup(body, method, clock, (plane, *probes), (held,), damping=10.0, precision=variant.precision)
