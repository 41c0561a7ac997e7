"""The exact distance to triangles at the points of a grid near them, compiled."""

from massspring.kernels.jit.decorators import compiled
from studies.geometry.surface.triangle_distance import edges_into, squared_to_triangle


@compiled
def band_distance_into(corners, reach, scratch, squared, owner):
    """Lower squared (a, b, c) to the squared distance to the triangles at grid points within `reach` of their boxes.

    Lengths in cells from the first grid point. corners (t, 3, 3); scratch (4, 3); owner (a, b, c) gets the nearest one.
    """
    u, v, n, p = scratch
    for f in range(len(corners)):
        triangle = corners[f]
        square = edges_into(triangle, u, v, n)
        i0, i1 = cells_between(triangle[:, 0], reach, squared.shape[0])
        j0, j1 = cells_between(triangle[:, 1], reach, squared.shape[1])
        k0, k1 = cells_between(triangle[:, 2], reach, squared.shape[2])
        for i in range(i0, i1):
            for j in range(j0, j1):
                for k in range(k0, k1):
                    p[0], p[1], p[2] = i, j, k
                    height = (i - triangle[0, 0]) * n[0] + (j - triangle[0, 1]) * n[1] + (k - triangle[0, 2]) * n[2]
                    # The plane of a triangle is never farther away than the triangle itself.
                    if height * height <= squared[i, j, k] * square:
                        found = squared_to_triangle(p, triangle, u, v, n)
                        if found < squared[i, j, k]:
                            squared[i, j, k] = found
                            owner[i, j, k] = f


@compiled
def far_distance_into(corners, reach, owner, scratch, squared):
    """Lower squared (a, b, c) beyond `reach` to the squared distance to the triangle owner (a, b, c). In cells."""
    u, v, n, p = scratch
    for i in range(squared.shape[0]):
        for j in range(squared.shape[1]):
            for k in range(squared.shape[2]):
                if squared[i, j, k] > reach * reach:
                    p[0], p[1], p[2] = i, j, k
                    triangle = corners[owner[i, j, k]]
                    edges_into(triangle, u, v, n)
                    squared[i, j, k] = min(squared[i, j, k], squared_to_triangle(p, triangle, u, v, n))


@compiled
def cells_between(coordinates, reach, size):
    """First grid row within `reach` of three coordinates, and the one after the last, inside [0, size)."""
    low = min(coordinates[0], coordinates[1], coordinates[2]) - reach
    high = max(coordinates[0], coordinates[1], coordinates[2]) + reach
    return max(int(-(-low // 1)), 0), min(int(high // 1) + 1, size)
