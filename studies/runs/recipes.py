"""How the mass-spring body of a case is made from the scene's organ: a recipe for each kind of body."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, asdict, dataclass, fields, replace
from functools import cache
from typing import Any, ClassVar, Literal, Self

from pydantic import ConfigDict, TypeAdapter, with_config

from massspring.body.membranes import MEMBRANE_LAWS
from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.runs.user_code import law_names

ADAPTIVE, ADAPTER = "adaptive", "studies.reference.adaptive_mesh"
"""Value of `graded` for quadratic elements graded by one solution on a coarse mesh, and the module that computes it."""

OF_QUADRATIC = ("vertex", "element", "mixed")
"""Values of `volumes` of quadratic bodies. The JSON of a recipe leaves out the first: older ones know no other."""
VIRTUAL = "virtual"
"""Value of `cut` for a body that is cut through its cells."""


class _ByKind(type):
    """Lets `BodyRecipe("quadratic", 594)`, as written for release 0.3, make a QuadraticBody."""

    def __call__(cls, *given: Any, **settings: Any) -> Any:
        if cls is not BodyRecipe:
            return super().__call__(*given, **settings)
        kind, given = (given[0], given[1:]) if given else (settings.pop("kind", USUAL["kind"]), given)
        return lookup(kind, BODIES, "kind of body")(*given, **settings)


@dataclass(frozen=True)
class BodyRecipe(metaclass=_ByKind):
    """How a body is made: one of KINDS, also by `BodyRecipe(kind, nodes, ...)`. A setting that has no meaning for a
    kind of body is no setting of its recipe; who asks for it gets the answer of this class."""

    kind: ClassVar[str]
    law, volumes, regions, graded = "", "scene", 0, False
    mass, contact, cut = "lumped", "facets", "conforming"

    nodes: int = 550
    """Nodes on the outer surface. For a quadratic body mid-side nodes count, so a quarter of the nodes are vertices;
    for a graded body nodes added by grading count (within 5 %)."""
    _: KW_ONLY
    stiffness: float = 1.0
    """Factor on every spring; 1 matches the tissue's shear modulus."""

    def __new__(cls, *given: object, **settings: object) -> Self:
        """Raises StudyError for a setting that it does not have."""
        _check_own(cls, settings)
        return super().__new__(cls)

    @property
    def series(self) -> str:
        """Its label in charts and tables: kind, whether it is graded, volumes that it keeps, and masses if they are not
        the default."""
        volumes = {
            "scene": "",
            "whole": ", one volume",
            "regions": f", {self.regions} volumes",
            "patches": ", volumes of patches",
            "nodal": ", nodal volumes",
            "vertex": "",
            "element": ", volumes of elements",
            "mixed": ", mixed volumes",
        }
        words = {True: "graded ", False: "", ADAPTIVE: "adaptive "}[self.graded] + self.kind + volumes[self.volumes]
        words += ", contact at nodes" if self.contact == "nodes" else ""
        words += ", virtual nodes" if self.cut == VIRTUAL else ""
        return words + {"lumped": "", "stiffness": ", masses by stiffness", "heavy": ", heavy masses"}[self.mass]

    @property
    def chosen(self) -> dict[str, Any]:
        """Kind and settings that differ from USUAL."""
        return {name: value for name, value in recipe_to_dict(self).items() if value != USUAL[name]}

    @property
    def words(self) -> list[str]:
        """The chosen settings as words of the name of a case: "nodal", "graded", "k2"."""
        chosen = self.chosen
        return [word(self) for name, word in WORDS.items() if name in chosen]


WORDS: dict[str, Callable[[Any], str]] = {
    "law": lambda body: body.law,
    "volumes": lambda body: f"{body.regions}regions" if body.volumes == "regions" else body.volumes,
    "graded": lambda body: ADAPTIVE if body.graded == ADAPTIVE else "graded",
    "mass": lambda body: f"{body.mass}_mass",
    "contact": lambda body: f"{body.contact}_contact",
    "cut": lambda body: f"{body.cut}_nodes",
    "axis": lambda body: body.axis,
    "stiffness": lambda body: f"k{body.stiffness:g}",
    "weights": lambda body: "w" + "_".join(f"{weight:g}" for weight in body.weights),
}


@dataclass(frozen=True)
class TetrahedralBody(BodyRecipe):
    """Springs on the edges of the filled mesh."""

    kind: ClassVar[str] = "tetrahedral"
    _: KW_ONLY
    law: str = "van_gelder"
    """Stiffness law: one of LAWS or SMOOTHED, or a user's law (`studies.own_law`); springs without length need nodal
    volumes."""
    volumes: Literal["scene", "whole", "regions", "patches", "nodal"] = "scene"
    """Which volumes are kept. "scene": those that are physically separate, the wall and a closed lumen of a hollow
    organ; "whole": one, enclosed by the outer surface, as in the paper; "regions": `regions` parts; "nodal": one per
    node; "patches": one for about eight nodes."""
    regions: int = 32
    """How many, where volumes is "regions"."""
    graded: bool = False
    """Whether elements are halved where the scene holds and touches the body (studies.meshing.graded_mesh), once at
    outlines and twice at contacts, for a hollow organ once at contacts only."""
    cut: Literal["conforming", "virtual"] = "conforming"
    """How the body of a scene with a cut is cut: along faces of a mesh that is made for it, or through the cells of any
    mesh by virtual nodes (studies.meshing.virtual_mesh)."""

    def __post_init__(self) -> None:
        lookup(self.law, law_names(), "stiffness law")
        if self.volumes in OF_QUADRATIC:
            raise StudyError(
                f"volumes '{self.volumes}' are of quadratic elements; take a QuadraticBody, or volumes='nodal'"
            )
        if self.graded not in (True, False):
            raise StudyError("a tetrahedral body is not graded by a solution; take a QuadraticBody or graded=True")


@dataclass(frozen=True)
class SurfaceBody(BodyRecipe):
    """The paper's body (JHC05): springs on the outer surface and to an axis inside, with one volume."""

    kind: ClassVar[str] = "surface"
    _: KW_ONLY
    axis: Literal["straight", "centre_line"] = "straight"
    """"centre_line" follows a bent organ."""
    weights: tuple[float, float, float, float] | None = None
    """Relative stiffness of structural, bending, inner and axial springs; None for 1, ½, ½, 1."""


@dataclass(frozen=True)
class MembraneBody(BodyRecipe):
    """The outer surface of a hollow organ as a thin wall round its content, with one volume."""

    kind: ClassVar[str] = "membrane"
    _: KW_ONLY
    law: Literal["delingette", "lloyd"] = "delingette"
    """Stiffness law."""

    def __post_init__(self) -> None:
        lookup(self.law, MEMBRANE_LAWS, "stiffness law of a membrane")


@dataclass(frozen=True)
class QuadraticBody(BodyRecipe):
    """Springs between all nodes of quadratic tetrahedra, which follow the true shape."""

    kind: ClassVar[str] = "quadratic"
    _: KW_ONLY
    graded: bool | Literal["adaptive"] = False
    """As for a tetrahedral body; mid-side nodes are also shifted towards outlines. "adaptive": elements are halved
    where one solution with reference elements has its largest error indicators (studies.reference.adaptive_mesh)."""
    mass: Literal["lumped", "stiffness", "heavy"] = "lumped"
    """Inertial mass: the body's own, or "stiffness": the same total mass, distributed in proportion to the stiffness at
    each node, for longer steps if inertia does not matter (studies.scene.inertia); "heavy": more of it, as much as the
    loads and the slowest swing allow, and more damping where nothing moves (studies.runs.heavy)."""
    volumes: Literal["vertex", "element", "mixed"] = "vertex"
    """Which volumes are kept: one per vertex, with continuous pressures; one per element; "mixed": one per element with
    a node in a held region, at whose edge the pressure jumps, and one per vertex elsewhere."""
    contact: Literal["facets", "nodes"] = "facets"
    """Where spheres and capsules touch it: at points inside its facets, or at its nodes, which is cheaper. Planes touch
    nodes."""

    def __post_init__(self) -> None:
        lookup(self.volumes, OF_QUADRATIC, "kind of volumes of a quadratic body")


KINDS = TetrahedralBody, SurfaceBody, MembraneBody, QuadraticBody
BODIES: dict[str, type[BodyRecipe]] = {body.kind: body for body in KINDS}
"""Kind -> recipe."""
USUAL: dict[str, Any] = {"kind": TetrahedralBody.kind} | {
    setting.name: setting.default for body in reversed(KINDS) for setting in fields(body)
}
"""Every setting of any kind -> its default; of those that several kinds have, that of a tetrahedral body."""


def recipe_to_dict(body: BodyRecipe) -> dict[str, Any]:
    """JSON-able form: kind and settings, without the volumes that a quadratic body had before it could choose."""
    whole = {"kind": body.kind, **asdict(body)}
    return {name: value for name, value in whole.items() if (name, value) != ("volumes", OF_QUADRATIC[0])}


def recipe_from_dict(data: Mapping[str, Any]) -> BodyRecipe:
    """The recipe of a JSON-able form. Raises StudyError, and pydantic's ValidationError for a wrong type.

    Release 0.3 wrote every setting for every kind: those that the kind does not have are passed over where they have
    their default, and `regions` wherever it has no meaning, since smoke runs lowered it for every kind.
    """
    kind = lookup(data["kind"], BODIES, "kind of body")
    own = [setting.name for setting in fields(kind)]
    passed = {"kind", "regions", *(name for name in USUAL if data.get(name) == USUAL[name])}
    settings = {name: value for name, value in data.items() if name in own or name not in passed}
    if kind is QuadraticBody and settings.get("volumes", "scene") == "scene":  # written before it could choose
        settings["volumes"] = OF_QUADRATIC[0]
    _check_own(kind, settings)
    return _strict(kind).validate_python(settings)


def _check_own(kind: type[BodyRecipe], settings: Mapping[str, object]) -> None:
    """Raises StudyError for a setting that a kind of body does not have."""
    own = [setting.name for setting in fields(kind)]
    foreign = [name for name in settings if name not in own]
    if foreign:
        raise StudyError(f"a {kind.kind} body has no setting '{foreign[0]}'; it has {', '.join(own)}")


@cache
def _strict(kind: type[BodyRecipe]) -> TypeAdapter[BodyRecipe]:
    return TypeAdapter(with_config(ConfigDict(extra="forbid"))(kind))


NEIGHBOURS = (0.94, 0.97, 1.0, 1.03, 1.06)
"""Numbers of nodes of neighbouring meshes, over that of a recipe."""


def neighbours(body: BodyRecipe) -> tuple[BodyRecipe, ...]:
    """The recipe on five meshes with nearly as many nodes. A single mesh is a random sample: errors of neighbours may
    differ by a factor of four (docs/accuracy.md)."""
    return tuple(replace(body, nodes=round(share * body.nodes)) for share in NEIGHBOURS)
