"""The table of what a method supports. Refusals, the rows of the tests and docs/methods.md are derived from it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from massspring.body.body import SAME_VOLUME, Body
from massspring.body.points import PointVolumes

Kept = Literal["none", "whole", "several", "tetrahedra", "points", "elements"]
"""Volumes that a method keeps: none; the one inside the body's surface; one or several of any kind; each tetrahedron of
the tissue; only volumes over points of quadratic elements; those of linear or quadratic elements of an elastic solid
whose springs without length carry the shear."""

Correction = Literal["limited", "full", "penalty", "unbounded"]
"""How a step corrects a volume error. "limited": the correction of each volume moves a node by at most
`correction_limit` (eq. 8.5), and later steps correct the rest. "full": the step corrects the whole error. "penalty": by
a force that only the stable step length bounds. "unbounded": by a force that grows without bound as the volume goes to
0, so that a crushed body bursts and the run diverges."""


@dataclass(frozen=True)
class No:
    """Not supported."""

    because: str

    def __bool__(self) -> bool:
        return False


Support = Literal[True] | No


@dataclass(frozen=True)
class Capabilities:
    """Capabilities of a method with given settings. Promises about its results (order, volume) are claims, not
    capabilities."""

    keeps: Kept
    correction: Correction | None = None
    """None if no volume is corrected. Otherwise steps in which a volume has no gradient are counted, except for hard
    elements, whose compliance leaves no residual there."""
    conditionally_stable: bool = True
    """Whether steps beyond the stability limit diverge; if not, only accuracy limits the step."""
    converged: Support = True
    """Whether the answer at rest is the same for any order of nodes and elements and tends to one limit with the step
    (tests/massspring/methods/test_converged.py)."""
    triangle_springs: Support = True
    """Bodies with triangle springs (membranes)."""
    prestress: Support = No("it does not start with the pressures that balance these springs at rest")
    """Springs without rest length, balanced at rest by the pressure of the kept volumes."""
    point_volumes: Support = No("it has no sums over points")
    """Volumes over points of quadratic elements."""
    facet_contact: Support = No("obstacles touch its nodes")
    """Bodies that obstacles touch at points inside facets."""
    thin_probes: Support = No("its steps have no stage for them")
    """Thin probes, with contact in continuous time."""
    face_contact: Support = No("its steps do not keep the faces of a cut apart")
    """Faces of a cut that touch each other."""
    float32: Support = No("its claims are measured in float64")
    """A state in single precision."""
    events: Support = True
    """Bodies that change during a run, as by a cut: the next frame takes positions, velocities and pressures alone."""

    @property
    def targets(self) -> Support:
        """Whether a volume follows a target that changes."""
        return No("it keeps no volume") if self.keeps == "none" else True

    def why_not(self, body: Body) -> str | None:
        """Why `body` cannot be advanced; None when it can."""
        if len(body.membrane.triangles) and isinstance(self.triangle_springs, No):
            return f"it supports no triangle springs, {self.triangle_springs.because}; take implicit_volume"
        if body.rest_pressure and isinstance(self.prestress, No):
            return (
                f"it supports no springs without length (law '{body.law}'), {self.prestress.because}; "
                "take implicit_volume, or another law"
            )
        if isinstance(body.kept, PointVolumes) and isinstance(self.point_volumes, No):
            return f"it supports no quadratic body, {self.point_volumes.because}; take implicit_volume"
        if len(body.contact_facets) and isinstance(self.facet_contact, No):
            return f"it supports no contact inside facets, {self.facet_contact.because}; take contact 'nodes'"
        if body.share is not None and self.keeps != "several":
            return "it knows no cells of which a part alone is tissue, as virtual nodes make them; take implicit_volume"
        if self.keeps == "elements":
            return _why_not_elements(body)
        if self.keeps == "points":
            return _why_not_points(body)
        if self.keeps == "tetrahedra":
            return _why_not_each_tetrahedron(body)
        return _why_not_one_volume(body) if self.keeps == "whole" else None


def _why_not_points(body: Body) -> str | None:
    if not isinstance(body.kept, PointVolumes):
        return "its springs must have no length and its volumes lie at points; take a quadratic body"
    return None if len(body.contact_facets) else "it meets obstacles inside facets, not at nodes; take contact 'facets'"


def _why_not_elements(body: Body) -> str | None:
    if not body.rest_pressure:
        return "its springs must have no length; take law 'cotangent' with one volume per node, or a quadratic body"
    if _why_not_one_volume(body) is None:
        return "it keeps the volume of each element, the body keeps the whole alone; keep one volume per node"
    return None


def _why_not_one_volume(body: Body) -> str | None:
    kept = body.kept
    if isinstance(kept, PointVolumes) or kept.count > 1:
        return f"it keeps one volume, the body keeps {kept.count}; keep the whole, or take implicit_volume"
    if not (np.abs(kept.share.data) == 1.0).all():
        return (
            "it keeps the volume of one closed surface, but this body keeps part of that volume; take implicit_volume"
        )
    return None


def _why_not_each_tetrahedron(body: Body) -> str | None:
    if not len(body.tetrahedra):
        return "it keeps the volume of every tetrahedron, the body has none; fill its mesh"
    reason = _why_not_one_volume(body)
    if reason is None and abs(body.rest_volumes[0] / body.tetrahedron_volumes.sum() - 1.0) > SAME_VOLUME:
        return "it keeps the volume of every tetrahedron, the body keeps a lumen too; take implicit_volume"
    return reason
