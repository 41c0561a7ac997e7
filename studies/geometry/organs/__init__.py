"""The organs, one file each: a level function, its box, its attachments. Adding one: a file and a line in SHAPES."""

from collections.abc import Callable

from studies.geometry.levelset import Shape
from studies.geometry.organs.ball import ball_shape
from studies.geometry.organs.liver import liver_shape

SHAPES: dict[str, Callable[..., Shape]] = {"ball": ball_shape, "liver": liver_shape}
