"""A case: scene × body recipe × method × time step, and its JSON form, the key under which it is stored."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError, with_config

from massspring import ImplicitVolume, Method
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.runs.case_checks import check_recipe, check_settings
from studies.runs.user_code import law_names, methods_by_name
from studies.scene.as_json import scene_from_dict, scene_to_dict
from studies.scene.scene import Scene

Seconds = float | Literal["auto"]
ADAPTIVE, ADAPTER = "adaptive", "studies.reference.adaptive_mesh"
"""Value of `graded` for quadratic elements graded by one solution on a coarse mesh, and the module that computes it."""

VIRTUAL = "virtual"
"""Value of `cut` for a body that is cut through its cells."""


@dataclass(frozen=True)
class BodyRecipe:
    """How the mass-spring body is made from the scene's organ."""

    kind: Literal["tetrahedral", "surface", "membrane", "quadratic"] = "tetrahedral"
    """"surface": the paper's (JHC05); "tetrahedral": springs on the edges of the filled mesh; "membrane": the outer
    surface of a hollow organ as a thin wall round its content; "quadratic": springs between all nodes of quadratic
    tetrahedra, which follow the true shape, with one volume per vertex."""
    nodes: int = 550
    """Nodes on the outer surface. For a quadratic body mid-side nodes count, so a quarter of the nodes are vertices;
    for a graded body nodes added by grading count (within 5 %)."""
    law: str = "van_gelder"
    """Stiffness law. For a tetrahedral body: one of LAWS or SMOOTHED, or a user's law (`studies.own_law`); springs
    without length need nodal volumes. For a membrane: "delingette" or "lloyd"."""
    stiffness: float = 1.0
    """Factor on every spring; 1 matches the tissue's shear modulus."""
    volumes: Literal["scene", "whole", "regions", "patches", "nodal"] = "scene"
    """Which volumes are kept. "scene": those that are physically separate, the wall and a closed lumen of a hollow
    organ; "whole": one, enclosed by the outer surface, as in the paper; "regions": `regions` parts; "nodal": one per
    node; "patches": one for about eight nodes."""
    regions: int = 32
    """How many, where volumes is "regions"."""
    axis: Literal["straight", "centre_line"] = "straight"
    """Axis of a surface body: "centre_line" follows a bent organ."""
    weights: tuple[float, float, float, float] | None = None
    """Of a surface body: relative stiffness of structural, bending, inner and axial springs; None for 1, ½, ½, 1."""
    graded: bool | Literal["adaptive"] = False
    """Whether elements are halved where the scene holds and touches the body (studies.meshing.graded_mesh), once at
    outlines and twice at contacts, for a hollow organ once at contacts only. Mid-side nodes of quadratic elements are
    also shifted towards outlines. "adaptive": quadratic elements are halved where one solution with reference elements
    has its largest error indicators (studies.reference.adaptive_mesh)."""
    mass: Literal["lumped", "stiffness"] = "lumped"
    """Inertial mass of a quadratic body: its mass, or "stiffness": the same total mass, distributed in proportion to
    the stiffness at each node, for longer steps if inertia does not matter (studies.scene.inertia)."""
    contact: Literal["facets", "nodes"] = "facets"
    """Where obstacles touch a quadratic body: at points inside its facets, or at its nodes, which is cheaper."""
    cut: Literal["conforming", "virtual"] = "conforming"
    """How the body of a scene with a cut is cut: along faces of a mesh that is made for it, or through the cells of any
    mesh by virtual nodes (studies.meshing.virtual_mesh), for tetrahedral bodies only."""

    def __post_init__(self) -> None:
        lookup(self.law, law_names(), "stiffness law")
        check_recipe(self)

    @property
    def series(self) -> str:
        """Its label in charts and tables: kind, whether it is graded, volumes that it keeps, and masses if they are not
        the default."""
        chosen = {
            "scene": "",
            "whole": ", one volume",
            "regions": f", {self.regions} volumes",
            "patches": ", volumes of patches",
            "nodal": ", nodal volumes",
        }
        words = {True: "graded ", False: "", ADAPTIVE: "adaptive "}[self.graded] + self.kind + chosen[self.volumes]
        words += ", contact at nodes" if self.contact == "nodes" else ""
        words += ", virtual nodes" if self.cut == VIRTUAL else ""
        return words if self.mass == "lumped" else words + ", masses by stiffness"


NEIGHBOURS = (0.94, 0.97, 1.0, 1.03, 1.06)
"""Numbers of nodes of neighbouring meshes, over that of a recipe."""


def neighbours(body: BodyRecipe) -> tuple[BodyRecipe, ...]:
    """The recipe on five meshes with nearly as many nodes. A single mesh is a random sample: errors of neighbours may
    differ by a factor of four (docs/accuracy.md)."""
    return tuple(replace(body, nodes=round(share * body.nodes)) for share in NEIGHBOURS)


LATER = {"weights": None, "graded": False, "mass": "lumped", "contact": "facets", "cut": "conforming"}
"""Settings of a recipe that were added after the first records, with their earlier fixed values."""
LATER_SETTINGS = {
    "implicit_volume": {"recovers": False},
    "explicit_elements": {"law": "neo_hookean"},
    "implicit_elements": {"law": "neo_hookean"},
}
"""The same for settings of methods, by name of the method."""


@dataclass(frozen=True)
class Case:
    """One point of a study."""

    scene: Scene
    body: BodyRecipe = field(default_factory=BodyRecipe)
    method: Method = field(default_factory=ImplicitVolume)
    dt: Seconds = "auto"
    """Time step [s], or "auto": `dt_fraction` of the stability limit."""
    dt_fraction: float = 0.5
    frames: int | None = None
    """Instead of the scene's number of frames; the duration stays."""
    beyond_limit: bool = False
    """Whether a step above the stability limit is allowed; otherwise it is refused."""
    precision: Literal["float64", "float32"] = "float64"
    """Precision of the mass-spring state; float32 only for methods that support it."""
    recorded: tuple[str, ...] = ()
    """Additional fields that metrics do not use: the energies of `massspring.run.history.EXTRA`, and "surface",
    positions of the outer surface for a replay (studies.runs.surface_frames)."""
    timed: bool = False
    """Whether frame times are measured by the timing protocol."""

    def __post_init__(self) -> None:
        for given, kind in ((self.scene, Scene), (self.body, BodyRecipe)):
            if not isinstance(given, kind):
                raise StudyError(f"a case needs a {kind.__name__}, not {given!r}; see `organbench list`")
        check_settings(self)

    @property
    def name(self) -> str:
        """Readable; unique within a study together with the hash of the whole case."""
        step = f"dt{self.dt_fraction:g}" if self.dt == "auto" else f"dt{1e3 * float(self.dt):.4g}ms"
        parts = [self.scene.name, self.body.kind, str(self.body.nodes), self.method.name, step]
        if self.body.kind != "surface" and self.body.law != "van_gelder":
            parts.append(self.body.law)
        if self.body.volumes != "scene":
            parts.append(f"{self.body.regions}regions" if self.body.volumes == "regions" else self.body.volumes)
        if self.body.graded:
            parts.append(ADAPTIVE if self.body.graded == ADAPTIVE else "graded")
        if self.body.mass != "lumped":
            parts.append(f"{self.body.mass}_mass")
        if self.body.contact != "facets":
            parts.append(f"{self.body.contact}_contact")
        if self.body.cut == VIRTUAL:
            parts.append("virtual_nodes")
        if self.body.axis != "straight":
            parts.append(self.body.axis)
        if self.body.stiffness != 1.0:
            parts.append(f"k{self.body.stiffness:g}")
        if self.precision != "float64":
            parts.append(self.precision)
        if self.body.weights is not None:
            parts.append("w" + "_".join(f"{weight:g}" for weight in self.body.weights))
        parts += _settings(self.method)
        return "-".join(parts)

    @property
    def method_words(self) -> str:
        """The method and its chosen settings: "element bulk_modulus1e+06 hard"."""
        return " ".join([self.method.name, *_settings(self.method)])

    @cached_property
    def key(self) -> str:
        """Canonical JSON; equal text means equal case."""
        return json.dumps(case_to_dict(self), sort_keys=True, ensure_ascii=False)

    def replaced(self, **changes: Any) -> "Case":
        """A copy with some fields changed."""
        return replace(self, **changes)


def chosen_settings(method: Method) -> dict[str, Any]:
    """The settings of a method that are not its defaults, by name."""
    usual = asdict(type(method)())  # pyright: ignore[reportArgumentType]
    return {name: value for name, value in asdict(method).items() if value != usual[name]}  # pyright: ignore[reportArgumentType]


def _settings(method: Method) -> list[str]:
    """The chosen settings as words of a name: "hard", "iterations2", "whole"."""
    words = []
    for name, value in chosen_settings(method).items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        words.append(f"{name}{value:g}" if number else name if value is True else str(value))
    return words


def case_to_dict(case: Case) -> dict[str, Any]:
    """JSON-able form, without `timed`, since timing does not change results; `precision` and `recorded` only if they
    are not the default."""
    chosen: dict[str, Any] = {} if case.precision == "float64" else {"precision": case.precision}
    if case.recorded:
        chosen["recorded"] = list(case.recorded)
    return {
        "scene": scene_to_dict(case.scene),
        "body": _without(LATER, case.body),
        "method": {
            "name": case.method.name,
            "settings": _without(LATER_SETTINGS.get(case.method.name, {}), case.method),
        },
        "dt": case.dt,
        "dt_fraction": case.dt_fraction,
        "frames": case.frames,
        "beyond_limit": case.beyond_limit,
        **chosen,
    }


def _without(later: Mapping[str, Any], settings: Any) -> dict[str, Any]:
    """JSON-able form of `settings`; those in `later` only if they differ from their earlier values, so that older
    records stayed current."""
    return {name: value for name, value in asdict(settings).items() if name not in later or value != later[name]}


def case_from_json(text: str) -> Case:
    """The case with the key `text`. Raises StudyError if `text` is not the key of a case."""
    try:
        data = json.loads(text)
        case = Case(
            scene=scene_from_dict(data["scene"]),
            body=_strict(BodyRecipe).validate_python(data["body"]),
            method=method_from_dict(data["method"]),
            dt=data["dt"],
            dt_fraction=data["dt_fraction"],
            frames=data["frames"],
            beyond_limit=data["beyond_limit"],
            precision=data.get("precision", "float64"),
            recorded=tuple(data.get("recorded", ())),
        )
    except (json.JSONDecodeError, KeyError, TypeError, ValidationError) as error:
        raise StudyError(f"the text is not a stored case: {_first_line(error)}") from error
    unread = _unread(data, case_to_dict(case))
    if unread:
        raise StudyError(f"the text is not a stored case: unknown setting {', '.join(unread)}; correct or remove it")
    return case


def method_from_dict(data: Mapping[str, Any]) -> Method:
    """The method of {"name": …, "settings": {…}}; an unknown setting is an error. Raises StudyError."""
    kind = lookup(data["name"], methods_by_name(), "method")
    unknown = set(data["settings"]) - set(kind.__dataclass_fields__)  # pyright: ignore[reportAttributeAccessIssue]
    if unknown:
        raise StudyError(f"method '{kind.name}' has no setting {', '.join(sorted(unknown))}")
    return _strict(kind).validate_python(dict(data["settings"]))


@cache
def _strict(kind: type) -> TypeAdapter[Any]:
    return TypeAdapter(with_config(ConfigDict(extra="forbid"))(kind))


def _unread(given: Any, understood: Any, where: str = "") -> list[str]:
    """Names of the settings in `given` that `understood` lacks."""
    if isinstance(given, dict) and isinstance(understood, dict):
        names = [(f"{where}.{name}" if where else name, name) for name in given]
        lost = [path for path, name in names if name not in understood]
        return lost + [
            u for path, name in names if name in understood for u in _unread(given[name], understood[name], path)
        ]
    if isinstance(given, list) and isinstance(understood, list):
        pairs = enumerate(zip(given, understood, strict=False))
        return [u for number, (g, counterpart) in pairs for u in _unread(g, counterpart, f"{where}[{number}]")]
    return []


def _first_line(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        return f"{where} = {str(first['input'])[:60]!r}: {first['msg']}"
    return str(error).split("\n")[0]
