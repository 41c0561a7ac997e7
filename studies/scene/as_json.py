"""A scene as JSON text, and back."""

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from studies.base.errors import StudyError
from studies.scene.scene import Scene

LATER = ("contact", "until", "along", "opens_lumen")
"""Fields of cuts that were added after the first stored scenes with cuts, whose keys lack them."""


def scene_to_json(scene: Scene) -> str:
    """Canonical JSON of a scene."""
    return json.dumps(scene_to_dict(scene), sort_keys=True, ensure_ascii=False)


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """JSON-able form; without `cuts` if there are none, as before scenes could have cuts, and without fields of LATER
    that have their default."""
    data = _scene_adapter().dump_python(scene, mode="json")
    data["cuts"] = [{k: v for k, v in cut.items() if v or k not in LATER} for cut in data["cuts"]]
    return data if scene.cuts else {name: value for name, value in data.items() if name != "cuts"}


def scene_from_dict(data: Mapping[str, Any]) -> Scene:
    """The scene of a JSON-able form; pydantic checks every type."""
    return _scene_adapter().validate_python(data)


def scene_of_key(key: str) -> Scene:
    """The scene in the key of a stored case, even if its method or law is in a missing file. Raises StudyError."""
    try:
        return scene_from_dict(json.loads(key)["scene"])
    except (ValueError, KeyError, TypeError, ValidationError) as error:
        raise StudyError(f"the text is not a stored case, it has no scene: {str(error).splitlines()[0]}") from error


@cache
def _scene_adapter() -> TypeAdapter[Scene]:
    return TypeAdapter(Scene)
