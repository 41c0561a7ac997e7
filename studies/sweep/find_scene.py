"""A scene by name, or of a Python file of the user; and what such a file defines: STUDY, SCENE, or both."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.catalog.of_scene import study_of
from studies.catalog.study import Study
from studies.runs.user_code import load_file
from studies.scene.library import CUT, SCENES
from studies.scene.scene import Scene

SUFFIX = ".py"
BETWEEN = ":"
"""FILE.py:NAME is one of the scenes of a file."""


@dataclass(frozen=True)
class UserFile:
    """The definitions of a file; one of the two at least."""

    study: Study | None
    scene: Scene | None

    @property
    def as_study(self) -> Study:
        """STUDY, or where the file has SCENE alone, the study of that scene."""
        if self.study is not None:
            return self.study
        assert self.scene is not None  # read_user_file refuses a file with neither
        return study_of(self.scene)

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """SCENE and the scenes of STUDY, each name once."""
        of_study = self.study.scenes if self.study is not None else ()
        of_file = (self.scene,) if self.scene is not None else ()
        return tuple({scene.name: scene for scene in (*of_study, *of_file)}.values())


def split_word(word: str) -> tuple[str, str]:
    """FILE.py and the name of a scene in it, empty where none is given; for any other word two empty texts."""
    path, between, name = word.rpartition(SUFFIX + BETWEEN)
    if between:
        return path + SUFFIX, name
    return (word, "") if word.endswith(SUFFIX) else ("", "")


def read_user_file(path: str) -> UserFile:
    """Runs the file and reads STUDY and SCENE. Raises StudyError for a file that is missing, that fails, or that
    defines neither."""
    if not Path(path).is_file():
        raise StudyError(f"there is no file {path}; give a Python file that defines STUDY or SCENE")
    module = load_file(Path(path))
    study, scene = _typed(path, module, "STUDY", Study), _typed(path, module, "SCENE", Scene)
    if study is None and scene is None:
        raise StudyError(f"{path} defines neither STUDY nor SCENE; see CONTRIBUTING.md")
    return UserFile(study, scene)


def _typed(path: str, module: object, name: str, kind: type) -> Any:
    value = getattr(module, name, None)
    if value is not None and not isinstance(value, kind):
        raise StudyError(
            f"{name} of {path} is {type(value).__name__}; give a {kind.__name__}, as `from studies import "
            f"{kind.__name__}` has it"
        )
    return value


def find_scene(word: str) -> Scene:
    """A scene of the library by name, or that of FILE.py: SCENE, else the only scene of its STUDY. FILE.py:NAME is the
    scene of that name.

    Raises StudyError for an unknown name, a file without a scene, a file with several where none is named, and a scene
    that cannot start.
    """
    path, name = split_word(word)
    if not path:
        return lookup(word, {scene.name: scene for scene in (*SCENES, *CUT)}, "scene")
    file = read_user_file(path)
    from studies.scene.checks import check_scene  # with the geometry of organs, which takes a while to load

    for scene in file.scenes:
        check_scene(scene)
    by_name = {scene.name: scene for scene in file.scenes}
    if name:
        return lookup(name, by_name, f"scene of {path}")
    if file.scene is not None:
        return file.scene
    if len(by_name) != 1:
        which = f": {', '.join(by_name)}; name one of them, as {path}{BETWEEN}{next(iter(by_name))}" if by_name else ""
        raise StudyError(f"the STUDY of {path} has {len(by_name)} scenes{which}")
    return next(iter(by_name.values()))
