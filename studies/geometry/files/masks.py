"""Label masks (segmentations): the surface of one label of a NIfTI or NRRD image."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import find_objects, gaussian_filter

from studies.base.errors import StudyError
from studies.base.install import pip_install
from studies.base.within import check_unpacked, file_within
from studies.geometry.files.content import Content
from studies.geometry.mesh.organ_mesh import signed_volume

NIFTI, NRRD = (".nii", ".nii.gz"), (".nrrd", ".nhdr")
MOST_LABELS = 300
"""An image with more different values has grey values and no labels."""
ALIKE = 0.5
"""Share of pairs of labelled neighbouring voxels whose labels are equal: a mask has more, an image of grey values
less."""
Label = tuple[int, int]
"""Layer from 0, and the value of its voxels."""
SEGMENT = "segment it first (3D Slicer, ITK-SNAP, TotalSegmentator …) and give the label map"
BLUR = 0.8
"""Standard deviation of the Gaussian, in voxels, that smooths the staircase of the voxels; the volume is kept."""
SPREAD = 0.1
"""Half the width of the levels between which voxels are counted."""
ROOM = 5
"""Empty voxels around the label, so that the blurred label ends well inside."""
EXACT, ROUNDS = 2e-4, 8
"""Relative deviation of the volume of a surface from that of its voxels, a fifth of the promised one, and the most
steps to it."""
LONG_NAMES = {
    unit: {unit, *long, *(f"{name}s" for name in long)}
    for unit, long in {
        "um": ("µm", "μm", "micron", "micrometer", "micrometre"),
        "mm": ("millimeter", "millimetre"),
        "cm": ("centimeter", "centimetre"),
        "m": ("meter", "metre"),
        "in": ("inch", "inches"),
    }.items()
}
NIFTI_UNITS = {0: None, 1: "m", 2: "mm", 3: "um"}
"""Lengths by their code in the header (NIfTI-1.1 standard, xyzt_units)."""
NRRD_BYTES = {"char|int8": 1, "short|int16": 2, "long|int64|double": 8, "int|float": 4, "": 8}
"""Bytes of a voxel by what its type holds, the first that fits (teem.sourceforge.net/nrrd/format.html, "type")."""
SPACES = {
    "right-anterior-superior": (1.0, 1.0, 1.0),
    "left-anterior-superior": (-1.0, 1.0, 1.0),
    "left-posterior-superior": (-1.0, -1.0, 1.0),
}
"""Patient spaces of NRRD -> signs that turn them into that of NIfTI: to the right, the front and the head."""
FEW = 65_536
"""Labels below this are counted in a table."""
OTHERS = 6
"""Most labels that a sentence lists."""


@dataclass(frozen=True, eq=False)
class Mask:
    """An image of labels.

    layers: integers, shape (l, a, b, c), 0 where there is no label; labels of several layers may overlap
    affine: shape (4, 4), from the index of a voxel to its middle in the unit of the file; x to the patient's right, y
        to the front, z to the head where the header says it
    unit: the unit in the header, or the usual one of the format; None if it is unknown
    names: layer and label -> name, if the file has names
    by_custom: whether `unit` is only the usual one of the format, because the header states none
    remark: for the user, or None
    """

    layers: np.ndarray
    affine: np.ndarray
    unit: str | None
    names: dict[Label, str]
    by_custom: bool = False
    remark: str | None = None

    def name_of(self, label: Label) -> str:
        layer, value = label
        return self.names.get(label, str(value) if len(self.layers) == 1 else f"{value} of layer {layer}")


def is_mask(path: Path) -> bool:
    return path.name.lower().endswith((*NIFTI, *NRRD))


def read_mask(path: Path, part: str | None) -> tuple[Content, str | None]:
    """The surface of the label `part` (number or name; None: the only one), and a remark for the user or None. Raises
    StudyError for an image that is no mask, for an unknown label or several without a `part`, and if the package that
    reads it is not installed."""
    mask = load_nrrd(path) if path.name.lower().endswith(NRRD) else load_nifti(path)
    label = chosen_label(mask, part, path.name)
    points, triangles, cut = label_surface(mask, label, path.name)
    edge = (
        f"label {mask.name_of(label)} reaches the edge of the image: the organ is cut off flat there" if cut else None
    )
    content = Content(points, triangles, np.empty((0, 4), np.int64), unit=mask.unit, unit_by_custom=mask.by_custom)
    return content, "; ".join(filter(None, (mask.remark, edge))) or None


def load_nifti(path: Path) -> Mask:
    """A NIfTI image as a mask. Raises StudyError if it is no mask, or if nibabel is not installed."""
    try:
        import nibabel
    except ImportError as error:
        raise missing("nibabel", path) from error
    image: Any = nibabel.load(path)
    check_voxels(path, image.shape, image.get_data_dtype().itemsize)
    code = int(image.header["xyzt_units"]) & 7
    unit = NIFTI_UNITS.get(code, f"with the code {code}")
    labels = whole_numbers(np.squeeze(np.asanyarray(image.dataobj)), path)
    return Mask(labels[None], np.asarray(image.affine, float), unit or "mm", {}, by_custom=unit is None)


def load_nrrd(path: Path) -> Mask:
    """An NRRD image as a mask, with the names and layers of the segments of 3D Slicer. Raises StudyError if it is no
    mask, if its axes have no directions in space, if its data file lies elsewhere, or if pynrrd is not installed."""
    try:
        import nrrd
    except ImportError as error:
        raise missing("pynrrd", path) from error
    said = nrrd.read_header(str(path))
    check_data_file(path, said)
    each = next(size for words, size in NRRD_BYTES.items() if re.search(words, str(said.get("type"))))
    check_voxels(path, said.get("sizes", ()), each)
    data, header = nrrd.read(str(path))
    rows = np.asarray(header.get("space directions", np.diag(header.get("spacings", np.ones(data.ndim)))), float)
    placed = np.isfinite(rows).any(axis=1)
    if len(rows) == data.ndim and placed.sum() == data.ndim - 1:  # an axis without a direction lists layers
        axis = int(np.argmin(placed))
        kind = str(header.get("kinds", ["list"] * data.ndim)[axis])
        if data.shape[axis] > 1 and kind != "list":
            raise StudyError(f"{path.name} has an axis of kind {kind!r}, so it is no label mask; {SEGMENT}")
        data, rows = np.moveaxis(data, axis, 0), rows[placed]
    else:
        data = np.squeeze(data)[None]
    if rows.shape != (3, 3) or not np.isfinite(rows).all():
        raise StudyError(f"{path.name} does not say how its three axes lie in space; export it with 'space directions'")
    layers = np.stack([whole_numbers(layer, path) for layer in data])
    space = str(header.get("space", "")).lower()
    letters = {"".join(word[0] for word in long.split("-")): long for long in SPACES}
    signs = SPACES.get(letters.get(space, space))
    affine = np.eye(4)
    affine[:3, :3] = rows.T
    affine[:3, 3] = np.asarray(header.get("space origin", np.zeros(3)), float)
    if "left-handed" in space or space == "3dlh":
        raise StudyError(f"{path.name} is in the space {space!r}, a mirror image; export it as {', '.join(SPACES)}")
    affine = np.diag([*(signs or (1.0, 1.0, 1.0)), 1.0]) @ affine
    remark = None if signs else "its header names no patient space, so left and right may be exchanged"
    unit = stated_unit(header.get("space units", header.get("units", [])), path)
    usual = "mm" if signs and unit is None else None
    return Mask(layers, affine, unit or usual, segments(header), by_custom=usual is not None, remark=remark)


def check_voxels(path: Path, sizes: Iterable[int], itemsize: int) -> None:
    """Raise StudyError before more voxels are unpacked than a machine can hold."""
    bytes_of_all = float(itemsize) * math.prod(int(size) for size in sizes)
    check_unpacked(bytes_of_all, path.name, "crop the image to the organ, or store its labels as bytes")


def check_data_file(path: Path, header: Mapping[str, Any]) -> None:
    """Raise StudyError if the data lie in another file that is no regular one in the folder of the header."""
    for key in ("data file", "datafile"):
        if key in header:
            file_within(path.parent, header[key], path.name)


def stated_unit(words: Iterable[str], path: Path) -> str | None:
    """The unit that a header states for all axes, one of UNITS or as it stands there; None without one. Raises
    StudyError for different ones."""
    stated = {word.strip().strip('"').lower() for word in words} - {"", "???", "none", "unknown"}
    if len(stated) > 1:
        raise StudyError(
            f"{path.name} has axes in different units ({', '.join(sorted(stated))}); export it in one unit"
        )
    return next((next((unit for unit, long in LONG_NAMES.items() if word in long), word) for word in stated), None)


def segments(header: Mapping[str, Any]) -> dict[Label, str]:
    """Layer and label of each segment of 3D Slicer -> its name."""
    names = {}
    for key, value in header.items():
        match = re.fullmatch(r"(Segment\d+_)LabelValue", key)
        if match:
            names[int(header.get(f"{match[1]}Layer", 0)), int(value)] = str(header.get(f"{match[1]}Name", value))
    return names


def missing(name: str, path: Path) -> StudyError:
    return StudyError(
        f"{path.name} is a label mask, and {name}, which reads it, is not installed; "
        f"run {pip_install('organbench[masks]')}"
    )


def whole_numbers(data: np.ndarray, path: Path) -> np.ndarray:
    """The image as labels (a, b, c). Raises StudyError for another number of dimensions, fractions, or colours."""
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


def chosen_label(mask: Mask, part: str | None, name: str) -> Label:
    """The label `part`, by name or number, or the only one. Raises StudyError if it cannot be determined."""
    voxels = dict[Label, int]()
    for layer, labels in enumerate(mask.layers):
        counts = voxels_of(labels)
        if counts:
            check_labels(labels, len(counts), name)
        voxels |= {(layer, value): count for value, count in counts.items()}
    if not voxels:
        raise StudyError(f"{name} holds no label: every voxel is 0; give the segmentation")
    if part is None and len(voxels) == 1:
        return next(iter(voxels))
    text = "" if part is None else part.lower()
    found = [label for label in voxels if mask.name_of(label).lower() == text]
    found = found or [label for label in voxels if str(label[1]) == text]
    if len(found) == 1:
        return found[0]
    inventory = f"{name} holds {len(voxels)} label{'s' * (len(voxels) > 1)}: {listed(mask, voxels)}"
    way = "choose one by --part" if part is None else f"there is no {part!r} among them"
    raise StudyError(f"{inventory}; {f'{len(found)} of them are called {part!r}' if found else way}")


def voxels_of(labels: np.ndarray) -> dict[int, int]:
    if labels.size and labels.min() >= 0 and labels.max() < FEW:  # counting is faster than sorting
        counts = np.bincount(labels.ravel())
        return {int(k): int(counts[k]) for k in np.flatnonzero(counts) if k}
    numbers, counts = np.unique(labels, return_counts=True)
    return {int(k): int(n) for k, n in zip(numbers, counts, strict=True) if k != 0}


def listed(mask: Mask, voxels: dict[Label, int]) -> str:
    order = sorted(voxels, key=lambda label: -voxels[label])
    rows = []
    for label in order[:OTHERS]:
        name, value = mask.name_of(label), str(label[1])
        rows.append(f"{f'{value} ({name})' if label in mask.names else name} of {voxels[label]:,} voxels")
    return ", ".join(rows) + (f" and {len(order) - OTHERS} more" if len(order) > OTHERS else "")


def label_surface(mask: Mask, label: Label, name: str) -> tuple[np.ndarray, np.ndarray, bool]:
    """Points (n, 3) in the unit of the file and outward triangles (t, 3) around a label; whether the image cuts it off.

    The label is blurred by BLUR voxels; the surface is the level that encloses the volume of the voxels, found by the
    secant method. Raises StudyError if there is none.
    """
    from skimage.measure import marching_cubes  # loads slowly, and few files need it

    layer, value = label
    inside = mask.layers[layer] == value
    box = find_objects(inside.astype(np.int8))[0]
    part = np.pad(inside[box], ROOM).astype(np.float32)
    cut = any(s.start == 0 or s.stop == size for s, size in zip(box, inside.shape, strict=True))
    blurred, count = gaussian_filter(part, BLUR), int(part.sum())
    # A narrow wall has no level of a half; no level is beyond the values of the image.
    bounds, level, before = (1e-3 * float(blurred.max()), 0.999 * float(blurred.max())), 0.5, None
    for _ in range(ROUNDS):
        level = float(np.clip(level, *bounds))
        corners, triangles, _, _ = marching_cubes(blurred, level, allow_degenerate=False)
        triangles = triangles.astype(np.int64)
        excess = abs(signed_volume(corners.astype(float), triangles)) - count
        if abs(excess) <= EXACT * count:
            break
        # At first the number of voxels near the level says how the volume changes with it.
        slope = -np.count_nonzero(np.abs(blurred - level) < SPREAD) / (2.0 * SPREAD)
        if before is not None and level != before[0]:
            slope = (excess - before[1]) / (level - before[0])
        before, level = (level, excess), level - excess / min(slope, -1.0)
    else:
        raise StudyError(
            f"{name}: no smooth surface has the volume of the {count:,} voxels of label {mask.name_of(label)}; "
            "resample the mask with smaller voxels"
        )
    first = np.array([s.start for s in box]) - ROOM
    points = (corners.astype(float) + first) @ mask.affine[:3, :3].T + mask.affine[:3, 3]
    return points, triangles if signed_volume(points, triangles) > 0 else triangles[:, ::-1].copy(), cut
