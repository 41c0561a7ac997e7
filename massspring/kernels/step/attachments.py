"""Nodes whose motion is prescribed."""

from massspring.kernels.jit.decorators import njit_exposed, njit_lean
from massspring.kernels.jit.vec3 import plus, row, times


@njit_lean
def prescribe_velocity_into(x, held_nodes, held_group, held_rest, displacement, dt, v_star):
    """v*_i = (X_i + d_g − x_i)/dt [m/s] for every held node: it ends the step where its attachment is (eq. 3.2)."""
    for h in range(held_nodes.shape[0]):
        i = held_nodes[h]
        g = held_group[h]
        for axis in range(3):
            v_star[i, axis] = (held_rest[h, axis] + displacement[g, axis] - x[i, axis]) / dt


@njit_exposed
def prescribe(model, nodes, displacement, dt):
    """v* of held nodes (eq. 3.2); returns the change of G·v* [m³/s]."""
    held_nodes, groups, rest = model.held_nodes, model.held_group, model.held_rest
    x, v_star, gradient = nodes.x, nodes.v_star, nodes.gradient
    flow, per_step = 0.0, 1.0 / dt
    for h in range(held_nodes.shape[0]):
        i, g = held_nodes[h], groups[h]
        for axis in range(3):
            held = per_step * (rest[h, axis] + displacement[g, axis] - x[i, axis])
            flow += gradient[i, axis] * (held - v_star[i, axis])
            v_star[i, axis] = held
    return flow


@njit_exposed
def add_held_impulse(model, nodes, push, dt, gravity, held_impulse):
    """I_g = −dt Σ_i∈g (f_i + push_i + m_i g) [N s]: impulse of an attachment on the body, without the inertia of held
    nodes (eq. 3.6)."""
    held_nodes, groups, mass = model.held_nodes, model.held_group, model.mass
    h, count = 0, held_nodes.shape[0]
    while h < count:
        g, carried, force = groups[h], 0.0, (0.0, 0.0, 0.0)
        while h < count and groups[h] == g:
            i = held_nodes[h]
            force = plus(force, plus(row(nodes.force, i), times(push.factor, row(push.direction, i))))
            carried += mass[i]
            h += 1
        for axis in range(3):
            held_impulse[g, axis] -= dt * (force[axis] + carried * gravity[axis])
