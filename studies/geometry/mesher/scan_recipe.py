"""Making the mesh of a scan from its recipe, inside the worker process."""

import sys
from dataclasses import replace
from typing import Any

from studies.geometry.mesher.organ_recipe import even_surface, finish
from studies.geometry.mesher.worker import Arrays, work
from studies.geometry.scanned.scan_shape import scan_shape, scan_surface
from studies.geometry.surface.fit import evenly_spread, followed


def build_scan(recipe: dict[str, Any], arrays: Arrays) -> Arrays:
    """The shape that a given surface pictures, with `nodes` nodes, some of them where even ones would cut corners."""
    nodes = recipe["nodes"]
    shape = scan_shape(arrays["points"], arrays["triangles"], nodes, recipe["smooth"], recipe["name"])
    start = scan_surface(shape)
    points, triangles = even_surface(shape, start, evenly_spread(nodes))
    points, triangles = followed(shape, points, triangles, start[0], nodes)
    return finish(replace(shape, wall=recipe.get("wall")), points, triangles, recipe)


if __name__ == "__main__":
    sys.exit(work(build_scan, sys.argv[1], sys.argv[2]))
