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
from studies.runs.case_checks import check_settings
from studies.runs.recipes import BodyRecipe, TetrahedralBody, recipe_from_dict, recipe_to_dict
from studies.runs.user_code import methods_by_name
from studies.scene.as_json import scene_from_dict, scene_to_dict
from studies.scene.scene import Scene

Seconds = float | Literal["auto"]


@dataclass(frozen=True)
class Case:
    """One point of a study."""

    scene: Scene
    body: BodyRecipe = field(default_factory=TetrahedralBody)
    method: Method = field(default_factory=ImplicitVolume)
    dt: Seconds = "auto"
    """Time step [s], or "auto": `dt_fraction` of the stability limit."""
    dt_fraction: float = 0.5
    frames: int | None = None
    """Instead of the scene's number of frames; the duration stays. A few more are taken where that lets a frame end at
    each checkpoint."""
    beyond_limit: bool = False
    """Whether a step above the stability limit is allowed; otherwise it is refused."""
    precision: Literal["float64", "float32"] = "float64"
    """Precision of the mass-spring state; float32 only for methods that support it."""
    recorded: tuple[str, ...] = ()
    """Additional fields that metrics do not use: "surface",
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
        parts += self.body.words
        if self.precision != "float64":
            parts.append(self.precision)
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
        "body": recipe_to_dict(case.body),
        "method": {"name": case.method.name, "settings": asdict(case.method)},  # pyright: ignore[reportArgumentType]
        "dt": case.dt,
        "dt_fraction": case.dt_fraction,
        "frames": case.frames,
        "beyond_limit": case.beyond_limit,
        **chosen,
    }


def case_from_json(text: str) -> Case:
    """The case with the key `text`. Raises StudyError if `text` is not the key of a case."""
    try:
        data = json.loads(text)
        case = Case(
            scene=scene_from_dict(data["scene"]),
            body=recipe_from_dict(data["body"]),
            method=method_from_dict(data["method"]),
            dt=data["dt"],
            dt_fraction=data["dt_fraction"],
            frames=data["frames"],
            beyond_limit=data["beyond_limit"],
            precision=data.get("precision", "float64"),
            recorded=tuple(data.get("recorded", ())),
        )
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise StudyError(f"the text is not a stored case: {_first_line(error)}") from error
    unread = _unread(data | {"body": {}}, case_to_dict(case))
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
