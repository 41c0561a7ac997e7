"""A run with the data that metrics need: the stored case, its reference, its frame times."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesh.organ_mesh import triangle_areas
from studies.meshing.bounds import SHAPE
from studies.meshing.rest_surface import RestSurface, rest_surfaces, six_node_facets
from studies.meshing.true_surface import UNKNOWN, ShapeErrors, shape_errors
from studies.metrics.timing.protocol import FrameTiming
from studies.reference.load import Reference
from studies.reference.solution import BESIDE, doubled
from studies.runs.case import Case, case_from_json
from studies.scene.cut import nearest_cut
from studies.store.record import Record, read_record
from studies.store.schema import RunAttributes, RunFields


class BoundaryErrors(NamedTuple):
    """Errors at n boundary nodes of a reference."""

    places: np.ndarray
    """Rest positions, (n, 3) [m]."""
    wrong: np.ndarray
    """Displacement of the body minus that of the reference, (n, 3) [m]."""
    distance: np.ndarray
    """Distance to the nearest point of the body at rest, (n,) [m]."""
    areas: np.ndarray
    """Areas of the nodes, (n,) [m²]."""
    truth: np.ndarray
    """Displacement of the reference, (n, 3) [m]."""


@dataclass(frozen=True, eq=False)
class Run:
    """A measured case, with its reference and frame times if there are any."""

    case: Case
    record: Record
    reference: Reference | None = None
    timing: FrameTiming | None = None
    second: "Run | None" = None
    """Where no reference judges it: the same recipe on another mesh (studies.metrics.interval)."""

    @staticmethod
    def load(path: Path | str) -> "Run":
        """The run that is stored in `path`, without reference and frame times (`load_runs` finds both).

        Raises StudyError for a file without a run, and for a method from a user's file that this process has not
        loaded.
        """
        record = read_record(Path(path))
        if record.kind != "run":
            raise StudyError(f"{path} holds a {record.kind}, not a run; read_record opens it")
        return Run(case_from_json(record.key), record)

    @cached_property
    def fields(self) -> RunFields:
        """Stored arrays by name: `fields.t`; `RunFields` documents units and shapes. None for an optional field that is
        missing. Raises StudyError if nothing was computed."""
        return RunFields(self._words, {name: item.values for name, item in self.record.fields.items()})

    @cached_property
    def attributes(self) -> RunAttributes:
        """Stored numbers and texts by name: `attributes.dt`; else as `fields`."""
        return RunAttributes(self._words, self.record.attributes)

    @property
    def _words(self) -> str:
        return f"the record of {self.record.name}, {self.record.status},"

    def field(self, name: str) -> np.ndarray:
        """Stored values of the existing field `name`."""
        return self.record.fields[name].values

    @cached_property
    def checkpoint_frames(self) -> np.ndarray:
        """Index of the frame that ends at each checkpoint, (K,)."""
        return np.array([int(np.argmin(np.abs(self.fields.t - t))) for t in self.case.scene.checkpoints])

    @cached_property
    def force(self) -> np.ndarray:
        """The probed force of every frame [N], (F,)."""
        return self.case.scene.output_force(self.fields.contact_force, self.fields.held_force)

    @cached_property
    def volume_ratio(self) -> np.ndarray:
        """V/V0 of every frame [1], for the kept volume with the largest error in that frame, (F,)."""
        ratio = self.fields.volume / self.fields.volume_target
        return ratio[np.arange(len(ratio)), np.argmax(np.abs(ratio - 1), axis=1)]

    @cached_property
    def lumen(self) -> int | None:
        """Column of the lumen among the kept volumes; None if it is not kept."""
        column = int(self.record.attributes.get("lumen_column", -1))
        return column if column >= 0 else None

    @cached_property
    def tissue_pressure(self) -> np.ndarray:
        """Mean multiplier of the tissue's volumes [Pa], weighted by their size, (F,)."""
        size, lam = self.fields.volume_target, self.fields.pressure
        if self.lumen is not None:
            size, lam = np.delete(size, self.lumen, axis=1), np.delete(lam, self.lumen, axis=1)
        return (size * lam).sum(axis=1) / size.sum(axis=1)

    @cached_property
    def displacement_error(self) -> tuple[np.ndarray, np.ndarray]:
        """Displacements of the material nodes at the last checkpoint and their error [m], both (n, 3)."""
        assert self.reference is not None  # _against checked that
        rest = self.fields.rest[self.material_nodes]
        truth = self.reference.displacement(self.places[self.material_nodes])
        return truth, self.fields.snapshots[-1][self.material_nodes] - rest - truth

    @cached_property
    def places(self) -> np.ndarray:
        """Points at which the reference is evaluated for each node [m], (n, 3): rest positions; for nodes on a cut
        moved slightly to the side of the node."""
        rest, scene = self.fields.rest, self.case.scene
        if not scene.cuts:
            return rest
        places, step = rest.copy(), BESIDE * self.size * self._pair_normals
        places[self.cut_pairs[:, 0]] -= step
        places[self.cut_pairs[:, 1]] += step
        return places

    @cached_property
    def part_volumes(self) -> tuple[np.ndarray, np.ndarray]:
        """Volumes of the pieces of a cut body, and their targets [m³], both (F, r)."""
        pieces = self.field("cut_parts")
        of = (pieces[:, None] == np.unique(pieces)).astype(float)
        return self.fields.volume @ of, self.fields.volume_target @ of

    @property
    def cut_pairs(self) -> np.ndarray:
        """Nodes behind a cut and in front of it, (p, 2)."""
        return np.asarray(self.fields.cut_pairs)

    @cached_property
    def cut_of_pairs(self) -> np.ndarray:
        """Number of the scene's cut that made each pair, (p,)."""
        return nearest_cut(self.case.scene.cuts, self.fields.rest[self.cut_pairs[:, 0]])

    @property
    def _pair_normals(self) -> np.ndarray:
        """The unit normal of the cut of each pair, (p, 3)."""
        return np.array([cut.unit_normal for cut in self.case.scene.cuts])[self.cut_of_pairs]

    def gap(self, opening: np.ndarray) -> np.ndarray:
        """The component of `opening` (p, 3) [m] along the normal of the cut of each pair [m], (p,); negative if the
        faces overlap."""
        return (opening * self._pair_normals).sum(axis=1)

    @cached_property
    def opening(self) -> np.ndarray:
        """From each node behind the cut to its copy in front of it at the last checkpoint [m], (p, 3)."""
        behind, front = self.fields.snapshots[-1][self.cut_pairs.T]
        return front - behind

    @cached_property
    def cut_weights(self) -> np.ndarray:
        """Share of each pair in the area of the cut at rest [m²], (p,)."""
        faces = np.asarray(self.fields.cut_faces)
        area = triangle_areas(self.fields.rest, faces)
        share = np.bincount(faces.ravel(), weights=np.repeat(area / 3, 3), minlength=len(self.fields.rest))
        return share[self.cut_pairs[:, 0]]

    @cached_property
    def boundary_errors(self) -> BoundaryErrors | None:
        """Errors at the last checkpoint for each boundary node of the reference, on the surfaces that the body has. The
        node is compared with the nearest point of the body at rest, where the displacement is interpolated. None if
        `sides` is None."""
        assert self.reference is not None  # Metric checked that
        truth, sides = self.reference.boundary, self.sides or {}
        moved = self.fields.snapshots[-1] - self.fields.rest
        facets = self._outside(truth.points, truth.facets)
        places = self._on_own_side(truth.points, facets)
        parts = []
        for name, side in rest_surfaces(truth.points, facets).items():
            if name in sides:
                nodes = np.unique(side.facets)
                at = sides[name].nearest(places[nodes])
                wrong = sides[name].interpolated(moved, at) - truth.displacement[nodes]
                parts.append((places[nodes], wrong, at.distance, side.areas[nodes], truth.displacement[nodes]))
        return BoundaryErrors(*map(np.concatenate, zip(*parts, strict=True))) if parts else None

    @cached_property
    def true_surface_error(self) -> tuple[float, float]:
        """Mean error of the displacement over the true surface at the last checkpoint, weighted by area, and the
        largest true displacement there [m]; NaN if `sides` is None. A distance above SHAPE of the size is added to the
        error."""
        errors = self.boundary_errors
        if errors is None:
            return float("nan"), float("nan")
        assert self.reference is not None  # boundary_errors checked that
        far = SHAPE / 100.0 * float(np.linalg.norm(np.ptp(self.reference.boundary.points, axis=0)))
        lengths = np.linalg.norm(errors.wrong, axis=1) + np.maximum(0.0, errors.distance - far)
        mean = np.average(lengths, weights=errors.areas)
        return float(mean), float(np.linalg.norm(errors.truth, axis=1).max())

    @cached_property
    def material_nodes(self) -> np.ndarray:
        """Nodes that are material points of the organ; virtual nodes on an axis are not."""
        if len(self.fields.tetrahedra):
            return np.arange(len(self.fields.rest))
        return np.unique(self.fields.triangles)

    @property
    def sides(self) -> dict[str, RestSurface] | None:
        """The surfaces of the body at rest: "outer", and "lumen" for a hollow body; curved for a quadratic body. None
        for a record of a quadratic body without facets."""
        triangles = self.fields.triangles
        facets = six_node_facets(triangles) if self.case.body.kind == "quadratic" else triangles
        return None if facets is None else rest_surfaces(self.fields.rest, self._outside(self.fields.rest, facets))

    def _outside(self, points: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """The boundary `facets` (f, 3 or 6) without the faces of a cut, which coincide in pairs at rest."""
        return facets if not self.case.scene.cuts else facets[~doubled(points, facets, self.size)]

    def _on_own_side(self, points: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Nodes at `points` (n, 3) [m] of boundary `facets` (f, 3 or 6). Nodes at the mouth of a cut are moved slightly
        towards their facets, since otherwise the nearest point of the body could be on either side of the cut."""
        nodes, moved = facets.ravel(), points
        for cut in self.case.scene.cuts:
            sides = np.sign(cut.plane.level(points[facets[:, :3]].mean(axis=1)))
            side, count = (
                np.bincount(nodes, np.repeat(weights, facets.shape[1]), minlength=len(points))
                for weights in (sides, np.ones(len(facets)))
            )
            near = (np.abs(cut.plane.level(points)) < BESIDE * self.size) & (np.abs(side) == count)
            step = np.where(near, BESIDE * self.size * np.sign(side), 0.0)
            moved = moved + np.outer(step, cut.unit_normal)
        return moved

    @cached_property
    def shape(self) -> ShapeErrors:
        """Deviation of the body at rest from the true shape of its organ."""
        sides = self.sides
        if sides is None:
            return UNKNOWN
        return shape_errors(self.case.scene.organ, sides, filled=len(self.fields.tetrahedra) > 0)

    @cached_property
    def size(self) -> float:
        """Diagonal of the box of the nodes at rest [m]."""
        return float(np.linalg.norm(np.ptp(self.fields.rest, axis=0)))

    @cached_property
    def surface_weights(self) -> np.ndarray:
        """Rest area of each material node [m²], 0 inside."""
        triangles = self.fields.triangles
        area = triangle_areas(self.fields.rest, triangles)
        share = np.bincount(triangles.ravel(), weights=np.repeat(area / 3, 3), minlength=len(self.fields.rest))
        return share[self.material_nodes]


def by_scene(runs: Sequence[Run]) -> dict[str, list[Run]]:
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.case.scene.name, []).append(run)
    return groups
