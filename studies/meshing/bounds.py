"""Bounds on the deviation of a body from the true shape of its organ, for a recommendation or a run without a
warning."""

SHAPE, SHAPE_VOLUME = 1.0, 0.5
"""Bounds of shape_error and |shape_volume| [%]. A body that exceeds one of them is never recommended."""


def enough(nodes: int, worst: float) -> int:
    """Surface nodes with which a body of `nodes` that exceeds a bound of the shape by the factor `worst` keeps it: the
    errors fall at least as 1 over the nodes (a real liver: 3.05, 1.97 and 0.5 % with 1,194, 1,594 and 2,390)."""
    step = 10 ** (len(str(int(nodes * worst))) - 2)
    return int(-(-nodes * worst // step) * step)


REFERENCE_SHAPE = 0.5
"""Bound of shape_error of the finest mesh of a reference [%]. One beyond it is named: its uncertainty does not contain
what that does to an error."""
HELD_AREA, REFUSED_AREA = 3.0, 10.0
"""Relative errors of the area of a held region, against that on the true surface [%]: beyond HELD_AREA a warning,
beyond REFUSED_AREA an error."""
FACETS, ADAPTIVE_WALL = 20, 10
"""Fewest facets that should touch a probe; of adaptive bodies of hollow organs, whose targets are wider. With fewer its
force may have a wrong direction, which turns an organ about its held region (docs/accuracy.md). Of 44 bodies of random
stomachs and bladders with 8 to 20 facets the force is at most 4.8 % off, the displacement 1.6 % (targets 6 and 3)."""
FEW = 8
"""Fewer facets under a probe are marked: a sphere of 5 mm radius that presses an ellipsoid of 100 mm by 8 touches three
of 594 nodes, its force −4 %, and two of 300, +71 %."""
UNDER_TOOL, REFERENCE_UNDER_TOOL = 2.5, 1.25
"""Longest side of the facets under a tool, over its radius, before elements are halved where errors are large: of
bodies and of references. A sphere pushed in by 1.6 radii slipped through reference elements at 2.7, not at 2.5."""
SIDE = 3.5
"""Longest side of the facets under a probe, over its radius, in a body that is touched inside facets: 2.8 of those 594
nodes, 3.8 of those 300."""
