"""The true surface of an organ, sampled once per process, and the deviation of a body at rest from it."""

import hashlib
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from studies.base.errors import StudyError
from studies.geometry import read_mesh
from studies.geometry.mesh.organ_mesh import signed_volume
from studies.geometry.shape.levelset import Shape, at_depth
from studies.geometry.surface.distance import hausdorff
from studies.meshing.bounds import SHAPE, SHAPE_VOLUME
from studies.meshing.rest_surface import LUMEN, OUTER, RestSurface, rest_surfaces
from studies.meshing.true_shape import true_shape
from studies.scene.organ_file import scanned
from studies.scene.scene import Organ

ORGANS = 128
"""Most organs whose surfaces are cached, about 2 MB each."""


@dataclass(frozen=True, eq=False)
class TrueSurface:
    """The outer surface of an organ and, of a hollow one, its lumen."""

    sides: Mapping[str, tuple[np.ndarray, np.ndarray]]
    """OUTER and LUMEN -> points (n, 3) [m] on the surface and triangles (t, 3) between them, finer than a body's."""
    volumes: Mapping[str, float]
    """Volume inside each side [m³], negative for a lumen, so that the sum is the volume of the tissue."""

    @property
    def size(self) -> float:
        """Diagonal of the organ's box [m]."""
        return float(np.linalg.norm(np.ptp(self.sides[OUTER][0], axis=0)))


class ShapeErrors(NamedTuple):
    """Deviation of a body at rest from the true shape of its organ; NaN if that is unknown."""

    distance: float
    """Largest distance between both surfaces, seen from either, over the organ's size [1]."""
    volume: float
    """Volume over the true one, less 1 [1]."""

    def __str__(self) -> str:
        return f"up to {100 * self.distance:.2g} % of the size off the true surface, volume {100 * self.volume:+.2g} %"

    @property
    def worst(self) -> float:
        """The larger ratio of an error to its bound; above 1 the body misses the shape."""
        return 100.0 * max(self.distance / SHAPE, abs(self.volume) / SHAPE_VOLUME)


UNKNOWN = ShapeErrors(float("nan"), float("nan"))
_MEASURED: dict[tuple[str, bytes], ShapeErrors] = {}
"""Cache by organ and body: cases that differ only by method or step have the same body."""


def shape_errors(organ: Organ, sides: Mapping[str, RestSurface], filled: bool) -> ShapeErrors:
    """Errors of the surfaces of a body at rest, from `rest_surfaces`, relative to those of its organ; NaN if the
    surface of the organ is unknown, or if the body has other sides than the organ.

    filled: whether the body is the tissue, so that the lumen of a hollow organ counts.
    """
    digest = hashlib.sha256(f"{filled}".encode())
    for surface in sides.values():
        digest.update(surface.points.tobytes() + surface.facets.tobytes())
    key = _text(organ), digest.digest()
    if key not in _MEASURED:
        _MEASURED[key] = _measured(true_surface(organ), sides, filled)
    return _MEASURED[key]


def _measured(truth: TrueSurface | None, sides: Mapping[str, RestSurface], filled: bool) -> ShapeErrors:
    if truth is None or set(sides) != (set(truth.sides) if filled else {OUTER}):
        return UNKNOWN
    apart = [hausdorff(*surface.lattice(), *truth.sides[name]) for name, surface in sides.items()]
    volume = sum(surface.volume for surface in sides.values()) / sum(truth.volumes[name] for name in sides)
    return ShapeErrors(max(apart) / truth.size, volume - 1.0)


def true_surface(organ: Organ) -> TrueSurface | None:
    """The surface of an organ's level function; for a mesh file that is used unchanged, that of the file. None, with a
    warning, if the file is missing or has changed."""
    return _sampled(_text(organ))


def _text(organ: Organ) -> str:
    return json.dumps([organ.shape, dict(organ.parameters)], sort_keys=True, default=str)


@lru_cache(maxsize=ORGANS)
def _sampled(text: str) -> TrueSurface | None:
    organ = Organ(*json.loads(text))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the mesher has already warned of its repairs to a file
            shape = true_shape(organ)
            return _of_file(organ) if shape is None else _of_shape(shape, organ.shape == "file")
    except StudyError as error:
        warnings.warn(f"the shape of bodies is not measured: {error}", stacklevel=2)
        return None


def _of_file(organ: Organ) -> TrueSurface:
    mesh = read_mesh(scanned(organ, organ.shape)[0])
    sides = rest_surfaces(mesh.points, mesh.triangles)
    return TrueSurface(
        {name: (side.points, side.facets) for name, side in sides.items()},
        {name: side.volume for name, side in sides.items()},
    )


def _of_shape(shape: Shape, scan: bool) -> TrueSurface:
    shapes = {OUTER: shape} if shape.wall is None else {OUTER: shape, LUMEN: at_depth(shape, shape.wall)}
    sides = {name: _fine(each, scan) for name, each in shapes.items()}
    signs = {OUTER: 1.0, LUMEN: -1.0}
    return TrueSurface(
        {name: surface for name, (surface, _) in sides.items()},
        {name: signs[name] * volume for name, (_, volume) in sides.items()},
    )


def _fine(shape: Shape, scan: bool) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    """Points and triangles on f = 0, and the volume [m³] inside, to about 1e-5: its error falls with the squared edge,
    which the finer of two triangulations halves."""
    # Imported here because scikit-image takes half a second.
    from studies.geometry.scanned.scan_shape import scan_surface
    from studies.geometry.surface.first_surface import first_surface, quartered

    coarse = scan_surface(shape) if scan else first_surface(shape)
    fine = quartered(shape, *coarse)
    volume = signed_volume(*fine)
    return fine, volume + (volume - signed_volume(*coarse)) / 3.0
