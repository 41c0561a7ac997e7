"""Nodes whose motion is prescribed."""

from massspring.kernels.jit.decorators import njit_exposed, njit_lean


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
    force, direction, factor = nodes.force, push.direction, push.factor
    h, count = 0, held_nodes.shape[0]
    while h < count:
        g = groups[h]
        k0, k1, k2, carried = 0.0, 0.0, 0.0, 0.0
        while h < count and groups[h] == g:
            i = held_nodes[h]
            k0 += force[i, 0] + factor * direction[i, 0]
            k1 += force[i, 1] + factor * direction[i, 1]
            k2 += force[i, 2] + factor * direction[i, 2]
            carried += mass[i]
            h += 1
        held_impulse[g, 0] -= dt * (k0 + carried * gravity[0])
        held_impulse[g, 1] -= dt * (k1 + carried * gravity[1])
        held_impulse[g, 2] -= dt * (k2 + carried * gravity[2])
