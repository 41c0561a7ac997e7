"""How many bytes the record of a case will have, about, told before there is a mesh from what its fields will be."""

from studies.runs.case import Case
from studies.store.schema import SURFACE

NUMBER, SINGLE = 8, 4
"""Bytes of a number, and of one of the replay."""
HEAD = 22_000
"""Attributes, names, descriptions and what HDF5 keeps beside the numbers."""
REPLAY = 62
"""Moments of a replay."""
NODES = {"surface": 1.0, "membrane": 1.0, "tetrahedral": 1.6, "quadratic": 3.0}
"""Nodes of a body of each kind per node on its surface."""
CELLS = {"surface": 0.0, "membrane": 0.0, "tetrahedral": 3.5, "quadratic": 4.2}
"""Tetrahedra per node."""
SERIES = 10
"""Numbers of a frame beside those of its volumes, obstacles and held regions."""
REPEATS, STAGES = 5, 8
"""Of a timing."""


def record_bytes(case: Case) -> int:
    """0.8 to 1.8 times the size of 82 runs of the catalogue; one that breaks early is shorter."""
    scene, kind = case.scene, case.body.kind
    surface = case.body.nodes
    nodes = NODES[kind] * surface
    frame = SERIES + 3 * kept_volumes(case) + 4 * len(scene.obstacles) + 3 * len(scene.held)
    shape = nodes * (4 + 3 * len(scene.checkpoints) + 4 * CELLS[kind]) + 6 * surface
    extra = sum(name not in SURFACE for name in case.recorded)
    replay = 3 * SINGLE * REPLAY * surface if "surface" in case.recorded else 0
    return int(HEAD + NUMBER * (frames(case) * (frame + extra) + shape) + replay)


def timing_bytes(case: Case) -> int:
    """Of the frame times of a case."""
    return HEAD // 3 + NUMBER * frames(case) * (REPEATS + STAGES)


def frames(case: Case) -> int:
    """Of its run."""
    return case.frames or case.scene.frames


def kept_volumes(case: Case) -> float:
    """How many, about."""
    nodes = NODES[case.body.kind] * case.body.nodes
    if case.body.kind == "quadratic":  # one per vertex
        return nodes / 6
    few = 1.0 + bool(case.scene.lumen)
    return {"nodal": nodes, "patches": nodes / 8, "regions": float(case.body.regions)}.get(case.body.volumes, few)
