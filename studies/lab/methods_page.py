"""`python -m studies.lab.methods_page` writes docs/methods.md: what every method claims and supports."""

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from massspring import LITERATURE, METHODS, Method, Plane
from massspring.methods import VARIANTS
from massspring.methods.capabilities import No
from massspring.world.obstacles import Surroundings

PAGE = Path("docs/methods.md")
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


def claims(method: Method) -> list[str]:
    tolerance = "–" if method.volume_tol is None else f"{method.volume_tol:.0e}"
    name = words(method) + ("" if method.capabilities.converged else " §")
    return [name, str(method.order), tolerance, answer(method.conserves_angular_momentum), summary(method)]


def capabilities(method: Method) -> list[str]:
    own = method.capabilities
    supported = [answer(bool(getattr(own, name))) for name in OPTIONS]
    return [words(method), own.keeps, own.correction or "–", stable(method), *supported]


def reasons(methods: Iterable[Method]) -> list[list[str]]:
    """Rows: for each option the reasons why not, and which methods give them."""
    rows = []
    for name, title in OPTIONS.items():
        by_reason: dict[str, list[str]] = {}
        for method in methods:
            why = getattr(method.capabilities, name)
            if isinstance(why, No):
                by_reason.setdefault(why.because, []).append(words(method))
        rows += [[title, "; ".join(who), because] for because, who in by_reason.items()]
    return rows


def other(method: Method) -> list[str]:
    """Row of a method of the literature."""
    refused = {words: method.why_not_among(around) for words, around in AROUND.items()}
    cannot = [f"{words} ({reason.split(';')[0]})" for words, reason in refused.items() if reason]
    return [method.name, summary(method), method.capabilities.keeps, stable(method), "; ".join(cannot)]


def summary(method: Method) -> str:
    return (method.__doc__ or "").strip().split("\n")[0]


def stable(method: Method) -> str:
    return "below the limit" if method.capabilities.conditionally_stable else "any step"


def answer(supported: bool) -> str:
    return "yes" if supported else "no"


def methods_page() -> str:
    """The page as Markdown."""
    methods = [*(kind() for kind in METHODS), *VARIANTS]
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, keep_trailing_newline=True
    )
    return templates.get_template("methods_page.md.jinja").render(
        claims=map(claims, methods),
        options=[*OPTIONS.values()],
        capabilities=map(capabilities, methods),
        reasons=reasons(methods),
        others=[other(kind()) for kind in LITERATURE],
    )


if __name__ == "__main__":
    PAGE.write_text(methods_page(), encoding="utf-8")
