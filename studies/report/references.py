"""A table and a chart of the error bars of all references."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from massspring.sources import own_modules, source_fingerprint
from studies.base.atomic import write_whole
from studies.reference.load import Reference
from studies.reference.reference_solves import STUDY
from studies.reference.shape import shape_of
from studies.reference.uncertainty import FACTORS
from studies.scene.scene import Scene
from studies.store.paths import study_folder
from studies.store.tables import write_table
from studies.sweep.job import reference_jobs
from studies.sweep.load import References

TABLE, CHART = "uncertainty.csv", "uncertainty.png"


def references_by_scene(references: References, scenes: Iterable[Scene]) -> dict[str, Reference]:
    """Those that are solved on all their meshes, by the name of their scene; the study reports the others."""
    by_scene = {scene.name: references.of(scene) for scene in scenes}
    return {name: reference for name, reference in by_scene.items() if reference is not None}


def uncertainty_table(references: Mapping[str, Reference]) -> pd.DataFrame:
    """A row per scene and quantity: its shares, their sum, order, shift; relative [%]. The same in all rows of a scene:
    how far the finest mesh is from the true shape."""
    rows = []
    for scene, reference in references.items():
        shape = shape_of(reference)
        for quantity, uncertainty in reference.uncertainty.items():
            shares = {
                f"{name} [%]": 100 * uncertainty.shares.get(name, float("nan")) for name in ("mesh", "edge", *FACTORS)
            }
            rows.append(
                {
                    "scene": scene,
                    "quantity": quantity,
                    **shares,
                    "uncertainty [%]": 100 * uncertainty.total,
                    "order [1]": uncertainty.order,
                    "extrapolated shift [%]": 100 * uncertainty.shift,
                    "meshes": len(reference.meshes),
                    "unknowns": reference.record.attributes["unknowns"],
                    "shape_error [%]": 100 * shape.distance,
                    "shape_volume [%]": 100 * shape.volume,
                }
            )
    return pd.DataFrame(rows)


def state_of(*sources: str) -> str:
    """Hash of all that charts and tables are made from: `sources`, which name files with sizes and times, and the
    code."""
    return hashlib.sha256("\n".join([source_fingerprint(*own_modules()), *sources]).encode()).hexdigest()


def refresh_uncertainty(references: References, scenes: Iterable[Scene]) -> list[Path]:
    """Writes table and chart of the error bars, unless they are current; none if there is no reference."""
    each, root = list({scene.name: scene for scene in scenes}.values()), references.ledger.root
    folder = study_folder(root, STUDY)
    paths = [folder / TABLE, folder / CHART]
    state = state_of(references.ledger.state(reference_jobs(root, each)))
    stamp = root / "cache" / f"{STUDY}.drawn"
    if all(path.exists() for path in (*paths, stamp)) and stamp.read_bytes() == state.encode():
        return paths
    solved = references_by_scene(references, each)
    if not solved:
        return []
    from studies.plots.uncertainty import draw  # with matplotlib, which takes half a second to load

    write_table(paths[0], uncertainty_table(solved))
    draw({name: reference.uncertainty for name, reference in solved.items()}, paths[1])
    write_whole(stamp, state.encode())
    return paths
