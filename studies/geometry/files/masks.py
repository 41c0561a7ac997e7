"""Label masks (segmentations): the surface of one label of a NIfTI or NRRD image."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import find_objects, gaussian_filter

from studies.base.errors import StudyError
from studies.geometry.files.content import Content
from studies.geometry.mesh.organ_mesh import signed_volume

NIFTI, NRRD = (".nii", ".nii.gz"), (".nrrd", ".nhdr")
MOST_LABELS = 300
"""An image with more different values has grey values and no labels."""
ALIKE = 0.5
"""Share of pairs of labelled neighbouring voxels whose labels are equal: a mask has more, an image of grey values
less."""
SEGMENT = "segment it first (3D Slicer, ITK-SNAP, TotalSegmentator …) and give the label map"
BLUR = 0.8
"""Standard deviation of the Gaussian, in voxels, that smooths the staircase of the voxels; the volume is kept."""
ROOM = 5
"""Empty voxels around the label, so that the blurred label ends well inside."""
LONG_NAMES = {"mm": "mm", "millimeter": "mm", "millimetre": "mm", "cm": "cm", "m": "m", "meter": "m", "metre": "m"}
FEW = 65_536
"""Labels below this are counted in a table."""
OTHERS = 6
"""Most labels that a sentence lists."""


@dataclass(frozen=True, eq=False)
class Mask:
    """An image of labels.

    labels: integers, shape (a, b, c), 0 where there is no label
    affine: shape (4, 4), from the index of a voxel to its middle in the unit of the file
    unit: the unit in the header, or the usual one of the format; None if it is unknown
    names: label -> name, if the file has names
    by_custom: whether `unit` is only the usual one of the format, because the header states no known unit
    """

    labels: np.ndarray
    affine: np.ndarray
    unit: str | None
    names: dict[int, str]
    by_custom: bool = False

    @property
    def voxel(self) -> float:
        """Volume of a voxel, in the cube of the unit of the file."""
        return float(abs(np.linalg.det(self.affine[:3, :3])))


def is_mask(path: Path) -> bool:
    return path.name.lower().endswith((*NIFTI, *NRRD))


def read_mask(path: Path, part: str | None) -> tuple[Content, str | None]:
    """The surface of the label `part` (number or name; None: the only one), and a remark if the image cuts it off.
    Raises StudyError for an image that is no mask, for an unknown label or several without a `part`, and if the package
    that reads it is not installed."""
    mask = load_nrrd(path) if path.name.lower().endswith(NRRD) else load_nifti(path)
    label = chosen_label(mask, part, path.name)
    points, triangles, cut = label_surface(mask, label)
    name = mask.names.get(label, str(label))
    remark = f"label {name} reaches the edge of the image: the organ is cut off flat there" if cut else None
    none = np.empty((0, 4), np.int64)
    return Content(points, triangles, none, unit=mask.unit, unit_by_custom=mask.by_custom), remark


def load_nifti(path: Path) -> Mask:
    """A NIfTI image as a mask. Raises StudyError if it is no mask, or if nibabel is not installed."""
    try:
        import nibabel
    except ImportError as error:
        raise missing("nibabel", path) from error
    image: Any = nibabel.load(path)
    unit_name = image.header.get_xyzt_units()[0] if hasattr(image.header, "get_xyzt_units") else ""
    labels, unit = whole_numbers(np.asanyarray(image.dataobj), path), LONG_NAMES.get(unit_name.lower())
    return Mask(labels, np.asarray(image.affine, float), unit or "mm", {}, by_custom=unit is None)


def load_nrrd(path: Path) -> Mask:
    """An NRRD image as a mask, with the names of the segments of 3D Slicer. Raises StudyError if it is no mask, if its
    axes have no directions in space, or if pynrrd is not installed."""
    try:
        import nrrd
    except ImportError as error:
        raise missing("pynrrd", path) from error
    data, header = nrrd.read(str(path))
    labels, affine = whole_numbers(data, path), np.eye(4)
    directions = np.asarray(header.get("space directions", np.diag(header.get("spacings", np.ones(3)))), float)
    directions = directions[np.isfinite(directions).any(axis=1)]  # an axis that is a list, as of 3D Slicer, has none
    if directions.shape != (3, 3) or not np.isfinite(directions).all():
        raise StudyError(f"{path.name} does not say how its three axes lie in space; export it with 'space directions'")
    affine[:3, :3] = directions.T
    affine[:3, 3] = np.asarray(header.get("space origin", np.zeros(3)), float)
    names = {}
    for key, value in header.items():
        match = re.fullmatch(r"Segment(\d+)_LabelValue", key)
        if match:
            names[int(value)] = str(header.get(f"Segment{match[1]}_Name", value))
    unit_name = str(next(iter(header.get("space units", [])), "")).strip('"')
    return Mask(labels, affine, LONG_NAMES.get(unit_name.lower()), names)


def missing(name: str, path: Path) -> StudyError:
    return StudyError(
        f"{path.name} is a label mask, and {name}, which reads it, is not installed; "
        "run pip install 'organbench[masks]'"
    )


def whole_numbers(data: np.ndarray, path: Path) -> np.ndarray:
    """The image as labels (a, b, c). Raises StudyError for another number of dimensions, fractions, or colours."""
    data = np.squeeze(data)
    if data.ndim != 3:
        raise StudyError(
            f"{path.name} has {data.ndim} dimensions, and a label mask has 3; export one label map of one time"
        )
    if data.dtype.kind == "f":
        if not np.isfinite(data).all() or (data != np.round(data)).any():
            raise no_mask(path.name, "fractions")
        data = data.astype(np.int64)
    if data.dtype.kind not in "iub":
        raise StudyError(f"{path.name} contains colours or records, so it is not a label mask; give the segmentation")
    return data


def no_mask(name: str, why: str) -> StudyError:
    """The error for an image of grey values, such as CT or MR; why: what shows that."""
    return StudyError(f"{name} holds grey values ({why}), not a mask: {SEGMENT}")


def check_labels(labels: np.ndarray, count: int, name: str) -> None:
    """Raise StudyError for an image of grey values: many values (`count` different ones), or labelled neighbours that
    mostly differ."""
    if labels.min() < -1:
        raise no_mask(name, f"down to {int(labels.min()):,}")
    if count > MOST_LABELS:
        raise no_mask(name, f"{count:,} different ones")
    if count <= 2:
        return
    same = both = 0
    for axis in range(3):
        one, next_one = (np.moveaxis(labels, axis, 0)[cut] for cut in (slice(None, -1), slice(1, None)))
        inside = (one != 0) & (next_one != 0)
        both += int(inside.sum())
        same += int((inside & (one == next_one)).sum())
    if same < ALIKE * both:
        raise no_mask(name, f"{count:,} different ones, and {1 - same / both:.0%} of neighbouring voxels differ")


def chosen_label(mask: Mask, part: str | None, name: str) -> int:
    """The label `part`, by number or name, or the only one. Raises StudyError if it cannot be determined."""
    voxels = voxels_of(mask.labels)
    if not voxels:
        raise StudyError(f"{name} holds no label: every voxel is 0; give the segmentation")
    check_labels(mask.labels, len(voxels), name)
    if part is None and len(voxels) == 1:
        return next(iter(voxels))
    by_name = {mask.names.get(k, str(k)).lower(): k for k in voxels} | {str(k): k for k in voxels}
    if part is not None and part.lower() in by_name:
        return by_name[part.lower()]
    inventory = f"{name} holds {len(voxels)} label{'s' * (len(voxels) > 1)}: {listed(mask, voxels)}"
    raise StudyError(
        f"{inventory}; choose one by --part" if part is None else f"{inventory}; there is no {part!r} among them"
    )


def voxels_of(labels: np.ndarray) -> dict[int, int]:
    if labels.size and labels.min() >= 0 and labels.max() < FEW:  # counting is faster than sorting
        counts = np.bincount(labels.ravel())
        return {int(k): int(counts[k]) for k in np.flatnonzero(counts) if k}
    numbers, counts = np.unique(labels, return_counts=True)
    return {int(k): int(n) for k, n in zip(numbers, counts, strict=True) if k != 0}


def listed(mask: Mask, voxels: dict[int, int]) -> str:
    order = sorted(voxels, key=lambda k: -voxels[k])
    rows = [f"{k}{f' ({mask.names[k]})' if k in mask.names else ''} of {voxels[k]:,} voxels" for k in order[:OTHERS]]
    return ", ".join(rows) + (f" and {len(order) - OTHERS} more" if len(order) > OTHERS else "")


def label_surface(mask: Mask, label: int) -> tuple[np.ndarray, np.ndarray, bool]:
    """Points (n, 3) in the unit of the file and outward triangles (t, 3) around a label; whether the image cuts it off.
    The label is blurred by BLUR voxels; the surface is the level that has as many voxels inside as the label."""
    from skimage.measure import marching_cubes  # loads slowly, and few files need it

    inside = mask.labels == label
    box = find_objects(inside.astype(np.int8))[0]
    part = np.pad(inside[box], ROOM).astype(np.float32)
    cut = any(s.start == 0 or s.stop == size for s, size in zip(box, inside.shape, strict=True))
    blurred = gaussian_filter(part, BLUR)
    count = int(part.sum())
    above, below = -np.partition(-blurred.ravel(), [count - 1, count])[[count - 1, count]]
    corners, triangles, _, _ = marching_cubes(blurred, 0.5 * float(above + below), allow_degenerate=False)
    first = np.array([s.start for s in box]) - ROOM
    points = (corners.astype(float) + first) @ mask.affine[:3, :3].T + mask.affine[:3, 3]
    triangles = triangles.astype(np.int64)
    outward = triangles if signed_volume(points, triangles) > 0 else triangles[:, ::-1].copy()
    return points, outward, cut
