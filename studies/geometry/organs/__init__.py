"""The organs, one file each: level function, box and attachments. To add one, write a file and a line in SHAPES."""

from collections.abc import Callable

from studies.geometry.organs.ball import ball_shape
from studies.geometry.organs.bladder import bladder_shape
from studies.geometry.organs.kidney import kidney_shape
from studies.geometry.organs.liver import liver_shape
from studies.geometry.organs.spleen import spleen_shape
from studies.geometry.organs.stomach import stomach_shape
from studies.geometry.shape.levelset import Shape

SHAPES: dict[str, Callable[..., Shape]] = {
    "ball": ball_shape,
    "liver": liver_shape,
    "stomach": stomach_shape,
    "kidney": kidney_shape,
    "spleen": spleen_shape,
    "bladder": bladder_shape,
}
