"""A scene by name, or of a Python file of the user."""

from pathlib import Path

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.scene.scene import Scene
from studies.scenes import SCENES
from studies.sweep.own_files import load_file


def find_scene(name: str) -> Scene:
    """A scene of SCENES, or SCENE of a Python file. Raises StudyError."""
    if not name.endswith(".py"):
        return lookup(name, {scene.name: scene for scene in SCENES}, "scene")
    if not Path(name).is_file():
        raise StudyError(f"there is no file {name}; give a Python file that defines SCENE")
    scene = getattr(load_file(Path(name)), "SCENE", None)
    if not isinstance(scene, Scene):
        raise StudyError(f"{name} defines no SCENE of type studies.scene.scene.Scene")
    return scene
