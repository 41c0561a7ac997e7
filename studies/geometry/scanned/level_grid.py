"""Signed distances on a regular grid as a shape. distance_grid.py, which loads compiled code, computes them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates, spline_filter

from studies.geometry.shape.levelset import Shape


@dataclass(frozen=True, eq=False)
class DistanceGrid:
    """Signed distances on a regular grid, negative inside.

    low: first corner [m], shape (3,)
    cell: edge of the cells [m]
    values: distance [m] at the grid points, shape (a, b, c)
    """

    low: np.ndarray
    cell: float
    values: np.ndarray

    @property
    def high(self) -> np.ndarray:
        """Last corner [m], shape (3,)."""
        return self.low + self.cell * (np.array(self.values.shape) - 1)

    @property
    def volume(self) -> float:
        """Volume [m^3] where the distance is negative; cells at the surface count with their share."""
        # A plane at signed distance d from the centre of a cell cuts off about 1/2 - d/cell of it.
        return float(np.clip(0.5 - self.values / self.cell, 0.0, 1.0).sum() * self.cell**3)

    def level(self):
        """Function points (n, 3) [m] -> (n,) [m]: the cubic spline through the grid, twice continuously
        differentiable."""
        coefficients = spline_filter(self.values, order=3, mode="mirror")

        def f(points: np.ndarray) -> np.ndarray:
            places = (np.asarray(points, float) - self.low).T / self.cell
            return map_coordinates(coefficients, places, order=3, mode="mirror", prefilter=False)

        return f


def grid_from(arrays: Mapping[str, np.ndarray]) -> DistanceGrid:
    """The grid from arrays with the names of its fields."""
    return DistanceGrid(arrays["low"], float(arrays["cell"]), arrays["values"])


def shape_of(grid: DistanceGrid, name: str, wall: float | None = None) -> Shape:
    """The shape whose inside has negative distances; wall: thickness [m] of the wall of a hollow shape."""
    low, high = tuple(map(float, grid.low)), tuple(map(float, grid.high))
    return Shape(name, grid.level(), low, high, grid.cell, wall=wall)  # pyright: ignore[reportArgumentType]
