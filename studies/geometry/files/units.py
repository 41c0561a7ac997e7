"""Units of length of mesh files: stated by the user or the file, or recognised by the size of organs."""

import hashlib
import json
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from studies.base.errors import StudyError
from studies.base.within import file_within

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
GUESSED = ("m", "cm", "mm")
"""Units in which a size is compared with that of organs; the others have to be given."""
ORGAN = 0.02, 0.6
"""Longest side [m] of an organ: from a foetal kidney to the lungs of an adult."""
LARGEST, SMALLEST = 5.0, 1e-3
"""Longest side [m] above and below which nothing is an organ."""
LEAST_VOLUME = 1e-6
"""Volume [m³] below which an organ is one of a small animal: a mouse's heart has .15 mL, a human adrenal gland 4."""
FAR_AWAY = 1e3
"""Distance from the origin [m] beyond which coordinates have too few digits left for an organ."""
ABSURD = 1e6, 1e-9
"""Longest side [m] above and below which a file is not even examined."""
DETACHED = re.compile(rb"^data ?file:=?[ \t]*(\S.*?)\s*$", re.MULTILINE)
NAMES = {"m": "metres", "cm": "centimetres", "mm": "millimetres", "um": "micrometres", "in": "inches"}


@dataclass(frozen=True)
class Source:
    """A mesh file, with its unit, scale and part."""

    path: Path
    unit: str | None = None
    """Unit of the coordinates, one of UNITS; None: the one that the file states, or metres if only metres give the
    size of an organ."""
    scale: float = 1.0
    """Factor of the coordinates, applied before the unit."""
    longest_side: float | None = None
    """Longest side of the body [m], instead of a unit and a scale."""
    part: str | None = None
    """Name or number of the part, or label of the mask; None: the whole file, or the only label of a mask."""

    def __post_init__(self) -> None:
        """Raises StudyError for an unknown unit, an invalid length, or a longest side next to a unit or scale."""
        object.__setattr__(self, "path", Path(self.path))
        name = self.path.name
        if self.unit is not None:
            check_unit(self.unit)
        if not 0.0 < self.scale < np.inf:
            raise StudyError(f"{name}: a scale of {self.scale:g} is asked for; give a number above 0")
        if self.longest_side is None:
            return
        if not SMALLEST <= self.longest_side <= LARGEST:
            raise StudyError(
                f"{name}: a longest side of {self.longest_side:.4g} m is asked for; an organ has 1 mm to 5 m"
            )
        if self.unit is not None or self.scale != 1.0:
            raise StudyError(f"{name}: give the longest side, or a unit and a scale, but not both")

    def metres(self, side: float, header_unit: str | None) -> float:
        """Metres per unit of the file, including the scale.

        side: longest side in the unit of the file; header_unit: the one that it states. Raises StudyError if the user
        has to give the unit.
        """
        if self.longest_side is not None:
            return self.longest_side / side if side > 0 else 1.0
        return self.scale * UNITS[settled_unit(self.path.name, self.scale * side, self.unit or header_unit)]

    @property
    def sha256(self) -> str | None:
        """SHA-256 of the bytes of the file (hexadecimal) and of the data files that an NRRD header or a glTF names,
        which identifies it at any path; None if it cannot be read."""
        try:
            content = self.path.read_bytes()
            for name in named_by(self.path.suffix.lower(), content):
                with suppress(StudyError):  # its reader refuses what lies elsewhere
                    content += file_within(self.path.parent, name, self.path.name).read_bytes()
            return hashlib.sha256(content).hexdigest()
        except OSError:
            return None

    @property
    def recipe(self) -> dict[str, object]:
        """Scale, longest side and part, if they are given; JSON-able."""
        given = {"scale": None if self.scale == 1.0 else self.scale, "longest_side": self.longest_side}
        return {key: value for key, value in (given | {"part": self.part}).items() if value is not None}


def named_by(suffix: str, content: bytes) -> list[str]:
    """The data files that a file names."""
    if suffix == ".nhdr":
        return [name.decode(errors="replace") for name in DETACHED.findall(content)[:1]]
    if suffix != ".gltf":
        return []
    try:
        names = [str(buffer.get("uri", "data:")) for buffer in json.loads(content)["buffers"]]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):  # its reader says what is wrong
        return []
    return [unquote(name) for name in names if not name.startswith("data:")]


def stem_of(path: Path) -> str:
    """The name without its suffix; ".nii.gz" is one suffix: "spleen.nii.gz" becomes "spleen"."""
    return path.stem.removesuffix(".nii") if path.suffix == ".gz" else path.stem


def as_source(path: "str | Path | Source", unit: str | None) -> Source:
    """A path and a unit as a Source. Raises StudyError for a unit together with a Source."""
    if not isinstance(path, Source):
        return Source(Path(path), unit)
    if unit is not None:
        raise StudyError(f"{path.path.name}: its unit stands in the Source; leave it out here")
    return path


def check_unit(unit: str) -> None:
    if unit not in UNITS:
        raise StudyError(f"unit {unit!r} is not known; use one of {', '.join(UNITS)}")


def check_range(side: float, name: str, low: float = ABSURD[1], high: float = ABSURD[0]) -> None:
    """Raise StudyError for a longest side [m] outside `low` to `high`; 0 and NaN pass, because other checks report
    them."""
    if side > high or 0 < side < low:
        limit = f"larger than {LARGEST:g} m" if side > high else f"smaller than {1e3 * SMALLEST:g} mm"
        raise StudyError(
            f"{name}: the longest side is {side:.3g} m; no organ is {limit}: correct the unit or the scale, or export "
            "the file again"
        )


def length_of(text: str) -> float:
    """The length [m] that a text such as "19cm" or "190 mm" states. Raises StudyError for any other text."""
    match = re.fullmatch(r"\s*([0-9.]+(?:[eE][-+]?\d+)?)\s*([a-z]+)\s*", text)
    if not match or match[2] not in UNITS or match[1].count(".") > 1 or match[1] == ".":
        raise StudyError(f"'{text}' is not a length; give a number and its unit ({', '.join(UNITS)}), such as 19cm")
    return float(match[1]) * UNITS[match[2]]


def likely_units(side: float) -> list[str]:
    """The units in which `side` is a plausible longest side of an organ, the largest unit first."""
    return [unit for unit in GUESSED if ORGAN[0] <= side * UNITS[unit] <= ORGAN[1]]


def unit_question(name: str, side: float) -> str:
    """A question for the unit of a file whose longest side is `side`, with the possible answers."""
    guess = " or ".join(NAMES[unit] for unit in likely_units(side))
    what = f"the size of an organ in {guess}" if guess else "not a plausible organ size in m, cm or mm"
    return f"{name} does not say its unit; its longest side is {side:.4g}, {what}"


def settled_unit(name: str, side: float, unit: str | None) -> str:
    """`unit` if it is given, else "m" if only metres give the size of an organ; side: longest side in the unit of the
    file, scaled. Raises StudyError for an unknown unit, and if the user has to give it."""
    if unit is not None:
        if unit not in UNITS:
            raise StudyError(f"{name} states its lengths in an unknown unit, {unit!r}; say --unit {', '.join(UNITS)}")
        return unit
    if likely_units(side) == ["m"]:
        return "m"
    likely = (likely_units(side) or ["mm"])[-1]
    raise StudyError(
        f"{unit_question(name, side)}; say --unit {likely} (or another of {', '.join(UNITS)}), or --longest-side 19cm"
    )
