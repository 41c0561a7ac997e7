"""The real surfaces in shared/meshes, next to the project's folder."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[3].parent / "shared" / "meshes"
COARSE = ("liver_hra_552", "spleen_hra_550", "stomach_bp3d_542")
NAMES = (
    *COARSE,
    "liver_hra_4999",
    "spleen_hra_4997",
    "stomach_bp3d_5015",
    "liver_hra_18999",
    "stomach_bp3d_18881",
)


def real_surface(name):
    """Path of a real surface; skips the test where it is absent."""
    path = FOLDER / f"{name}.ply"
    if not path.exists():
        pytest.skip(f"the real surface {path.name} is not in shared/meshes next to the project")
    return path
