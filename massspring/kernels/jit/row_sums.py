"""Sums along a sparse row whose entries are four numbers: a vector register holds an entry.

The compiler vectorises loops, not the components of an entry. Rows of many entries are summed two entries at a time:
half as many iterations, and two independent sums.
"""

from massspring.kernels.jit.decorators import njit_inlined
from massspring.kernels.jit.vectors import across, add_product, doubled, four, put_row, spread_row, turned, unless


@njit_inlined
def sum_of_scaled(start, stop, index, value, factor, times, out, place):
    """out_place = times Σ_e factor[index_e] value_e over start ≤ e < stop; `value` (e, 4), `out` (·, 4)."""
    none, left = spread_row(0.0, value), (stop - start) & 1
    even, odd = none, none
    if start < stop:
        # The last entry of an odd count is computed without a branch, since the processor would mispredict it.
        even = unless(left == 0, add_product(none, spread_row(factor[index[start]], value), four(value, start)))
    for e in range(start + left, stop, 2):
        even = add_product(even, spread_row(factor[index[e]], value), four(value, e))
        odd = add_product(odd, spread_row(factor[index[e + 1]], value), four(value, e + 1))
    put_row(spread_row(times, value) * (even + odd), out, place)


@njit_inlined
def sum_of_products(start, stop, index, value, field):
    """Σ_e field[index_e] · value_e over start ≤ e < stop; `value` (e, 4), `field` (·, 4)."""
    none, left = spread_row(0.0, value), (stop - start) & 1
    even, odd = none, none
    if start < stop:
        even = unless(left == 0, add_product(none, four(value, start), four(field, index[start])))
    for e in range(start + left, stop, 2):
        even = add_product(even, four(value, e), four(field, index[e]))
        odd = add_product(odd, four(value, e + 1), four(field, index[e + 1]))
    return across(even + odd)


@njit_inlined
def sums_from_origin(start, stop, index, value, padded, weight):
    """Σ_e (places_j − places_o) · value_e and Σ_e weight_j |value_e|², j = index_e, o the first of them, in double;
    start < stop."""
    origin, left = four(padded, index[start]), (stop - start) & 1
    none = doubled(spread_row(0.0, value))
    odd_products, odd_squares = none, none
    products, squares = _from_origin(none, none, start, index, value, padded, weight, origin)
    products, squares = unless(left == 0, products), unless(left == 0, squares)
    for e in range(start + left, stop, 2):
        products, squares = _from_origin(products, squares, e, index, value, padded, weight, origin)
        odd_products, odd_squares = _from_origin(odd_products, odd_squares, e + 1, index, value, padded, weight, origin)
    return across(products + odd_products), across(squares + odd_squares)


@njit_inlined
def _from_origin(products, squares, e, index, value, padded, weight, origin):
    """Both sums with entry e."""
    entry = doubled(four(value, e))
    products = add_product(products, doubled(four(padded, index[e]) - origin), entry)
    return products, add_product(squares, spread_row(weight[index[e]], entry) * entry, entry)


@njit_inlined
def sum_of_areas(start, stop, corner, share, padded, out, place):
    """out_place = Σ_q share_q (x_2 − x_0) × (x_3 − x_1) with padded positions x of the corners (q, 4); `out` (·, 4)."""
    total = spread_row(0.0, padded)
    for q in range(start, stop):
        a = four(padded, corner[q, 2]) - four(padded, corner[q, 0])
        b = four(padded, corner[q, 3]) - four(padded, corner[q, 1])
        # a × b = (a b' − a' b)', where ' shifts the lanes by one; the outer ' is applied once, after the loop.
        total = add_product(total, spread_row(share[q], padded), a * turned(b) - turned(a) * b)
    put_row(turned(total), out, place)


@njit_inlined
def copy_scaled(times, value, row, out, place):
    """out_place = times value_row; both (·, 4)."""
    put_row(spread_row(times, value) * four(value, row), out, place)
