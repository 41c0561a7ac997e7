"""docs/methods.md: what every method claims and supports. `python -m studies.report.methods_page` writes it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path

from massspring import LITERATURE, METHODS, Method, Plane
from massspring.methods import VARIANTS
from massspring.methods.capabilities import No
from massspring.world.obstacles import Surroundings
from studies.base.atomic import write_whole

PAGE = Path("docs/methods.md")
HEAD = """# Methods

What each method claims and supports. `python -m studies.report.methods_page` writes this page from the classes in
massspring/methods. Equations and sources are in the docstring of each method and in the [theory](theory.md).
"""
CLAIMS = """
## Claims

A test, tests/massspring/methods/test_methods.py, checks every claim. *Order*: the error of a trajectory
falls with this power of the time step. *Volume*: the claim is that |V/V0 − 1| stays below this after a quiet step at
half the stability limit; – is no claim. *Angular momentum*: conserved to round-off in free flight.
"""
CAPABILITIES = """
## Capabilities

*Keeps*: no volume; the **whole**, one volume inside the body's surface; **several** volumes of any kind; every volume
of the **tetrahedra**; those over the **points** of quadratic elements; or those of the **elements** of an elastic
solid, linear or quadratic. *Correction* of a wrong volume: **limited**, a volume moves no node farther than a set
length in a step; **full**, the whole error in one step; **penalty**, by a force that the stable step bounds;
**unbounded**, by a force without a bound. *Stable*: below the stability limit, or at any step. A method refuses
what it does not support with one sentence. Every method supports planes, spheres and capsules with friction,
attachments, gravity and damping.
"""
REASONS = """
## Why not
"""
OTHERS = """
## Others of the literature

`LITERATURE`: alternatives to the methods above, which do not make the same claims
([theory](theory.md#14-others-of-the-literature)). *Keeps* and *stable* as above. They run in the same scenes against
the same reference. The study `literature` runs them in every scene; a case that a method cannot do is skipped with the
reason.
"""
AROUND: Mapping[str, Surroundings] = {
    "free bodies": Surroundings(),
    "weight": Surroundings(attachments=1, gravity=(0.0, 0.0, -9.81)),
    "friction": Surroundings((Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), friction=0.3),), 1),
    "a start in motion": Surroundings(attachments=1, moved=True),
    "volumes that change": Surroundings(attachments=1, targets=True),
}
"""What may be around a body, in words of the page."""
OPTIONS: Mapping[str, str] = {
    "targets": "targets of volumes that change",
    "triangle_springs": "triangle springs (membranes)",
    "prestress": "springs without length",
    "point_volumes": "quadratic bodies",
    "facet_contact": "contact inside facets",
    "thin_probes": "thin probes",
    "face_contact": "faces of a cut that touch",
    "float32": "float32",
    "events": "cuts",
}
"""Name in `Capabilities` -> words of the page."""


def words(method: Method) -> str:
    """Name, and the settings that are not the default ones."""
    settings = {field.name: field.default for field in fields(method) if field.default is not MISSING}  # pyright: ignore[reportArgumentType]
    changed = [
        f"{name} = {getattr(method, name)}" for name, usual in settings.items() if getattr(method, name) != usual
    ]
    return ", ".join([method.name, *changed])


def claims_of(method: Method) -> list[str]:
    """One row of the first table."""
    tolerance = "–" if method.volume_tol is None else f"{method.volume_tol:.0e}"
    turning = "yes" if method.conserves_angular_momentum else "no"
    summary = (method.__doc__ or "").strip().split("\n")[0]
    return [words(method), str(method.order), tolerance, turning, summary]


def capabilities_of(method: Method) -> list[str]:
    """One row of the second table."""
    own = method.capabilities
    stable = "below the limit" if own.conditionally_stable else "any step"
    answers = ["yes" if getattr(own, name) else "no" for name in OPTIONS]
    return [words(method), own.keeps, own.correction or "–", stable, *answers]


def reasons(methods: Iterable[Method]) -> list[list[str]]:
    """Rows of the last table: for each option the reasons why not, and which methods give them."""
    rows = []
    for name, title in OPTIONS.items():
        by_reason: dict[str, list[str]] = {}
        for method in methods:
            answer = getattr(method.capabilities, name)
            if isinstance(answer, No):
                by_reason.setdefault(answer.because, []).append(words(method))
        rows += [[title, "; ".join(who), because] for because, who in by_reason.items()]
    return rows


def others_of(method: Method) -> list[str]:
    """One row of the table of the literature."""
    stable = "below the limit" if method.capabilities.conditionally_stable else "any step"
    refused = {words: method.why_not_among(around) for words, around in AROUND.items()}
    cannot = [f"{words} ({reason.split(';')[0]})" for words, reason in refused.items() if reason]
    summary = (method.__doc__ or "").strip().split("\n")[0]
    return [method.name, summary, method.capabilities.keeps, stable, "; ".join(cannot)]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def methods_page() -> str:
    """The page as Markdown."""
    methods = [*(kind() for kind in METHODS), *VARIANTS]
    claims = table(("method", "order", "volume", "angular momentum", "what it does"), map(claims_of, methods))
    head = ("method", "keeps", "correction", "stable", *OPTIONS.values())
    supported = table(head, map(capabilities_of, methods))
    why = table(("not supported", "by", "because"), reasons(methods))
    head = ("method", "what it does", "keeps", "stable", "cannot do")
    others = table(head, [others_of(kind()) for kind in LITERATURE])
    return "\n".join([HEAD + CLAIMS, claims, CAPABILITIES, supported, REASONS, why, OTHERS, others, ""])


if __name__ == "__main__":
    write_whole(PAGE, methods_page().encode())
