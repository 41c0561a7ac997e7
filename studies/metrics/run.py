"""A run with what it is judged by: the stored case, its reference, its frame times."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.reference.load import Reference
from studies.runs.case import Case
from studies.store.record import Record
from studies.timing.protocol import FrameTiming


@dataclass(frozen=True, eq=False)
class Run:
    """A measured case, beside its reference and its frame times where there are any."""

    case: Case
    record: Record
    reference: Reference | None = None
    timing: FrameTiming | None = None

    def field(self, name: str) -> np.ndarray:
        """Stored values by name."""
        return self.record.fields[name].values

    @cached_property
    def checkpoint_frames(self) -> np.ndarray:
        """Index of the frame that ends at each checkpoint, (K,)."""
        return np.array([int(np.argmin(np.abs(self.field("t") - t))) for t in self.case.scene.checkpoints])

    @cached_property
    def force(self) -> np.ndarray:
        """The probed force of every frame [N], (F,)."""
        return self.case.scene.output_force(self.field("contact_force"), self.field("held_force"))

    @cached_property
    def volume_ratio(self) -> np.ndarray:
        """V/V0 of every frame [1], of the kept volume that is farthest off in it, (F,)."""
        ratio = self.field("volume") / self.field("volume_target")
        return ratio[np.arange(len(ratio)), np.argmax(np.abs(ratio - 1), axis=1)]

    @cached_property
    def lumen(self) -> int | None:
        """Column of the lumen among the kept volumes; None where it is none of them."""
        column = int(self.record.attributes.get("lumen_column", -1))
        return column if column >= 0 else None

    @cached_property
    def tissue_pressure(self) -> np.ndarray:
        """Mean multiplier of the tissue's volumes [Pa], weighted by their size, (F,)."""
        size, lam = self.field("volume_target"), self.field("pressure")
        if self.lumen is not None:
            size, lam = np.delete(size, self.lumen, axis=1), np.delete(lam, self.lumen, axis=1)
        return (size * lam).sum(axis=1) / size.sum(axis=1)

    @cached_property
    def displacement_error(self) -> tuple[np.ndarray, np.ndarray]:
        """Displacements of the material nodes at the last checkpoint and their error [m], both (n, 3)."""
        assert self.reference is not None  # _against checked it
        rest = self.field("rest")[self.material_nodes]
        truth = self.reference.displacement(rest)
        return truth, self.field("snapshots")[-1][self.material_nodes] - rest - truth

    @cached_property
    def material_nodes(self) -> np.ndarray:
        """Nodes that are points of the organ: virtual nodes on an axis are none."""
        if len(self.field("tetrahedra")):
            return np.arange(len(self.field("rest")))
        return np.unique(self.field("triangles"))

    @cached_property
    def size(self) -> float:
        """Diagonal of the box of the nodes at rest [m]."""
        return float(np.linalg.norm(np.ptp(self.field("rest"), axis=0)))

    @cached_property
    def surface_weights(self) -> np.ndarray:
        """Rest area of each material node [m²], 0 inside."""
        triangles = self.field("triangles")
        area = triangle_areas(self.field("rest"), triangles)
        share = np.bincount(triangles.ravel(), weights=np.repeat(area / 3, 3), minlength=len(self.field("rest")))
        return share[self.material_nodes]
