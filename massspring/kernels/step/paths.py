"""Paths that are linear between keys."""

from massspring.kernels.jit.decorators import njit_exposed


@njit_exposed
def displacements_into(t, first, times, keys, out):
    """Displacements [m] of o paths at times `t` (q,) [s] into `out` (q, o, 3), constant outside the keys.

    Keys of path p: rows `first[p]` … `first[p + 1] - 1` of `times` (k,) [s] and `keys` (k, 3) [m].
    """
    for p in range(first.shape[0] - 1):
        k, last = first[p], first[p + 1] - 1
        for q in range(t.shape[0]):
            k = first[p] if q > 0 and t[q] < t[q - 1] else k
            while k < last and times[k + 1] <= t[q]:
                k += 1
            inside = k < last and t[q] > times[k]
            for axis in range(3):
                at = keys[k, axis]
                if inside:
                    at += (keys[k + 1, axis] - at) / (times[k + 1] - times[k]) * (t[q] - times[k])
                out[q, p, axis] = at
