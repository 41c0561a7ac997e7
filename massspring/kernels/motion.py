"""Time stepping: symplectic Euler, prescribed nodes, and the multiplier of one volume."""

import math

from massspring.kernels.compiled import compiled


@compiled
def predict_velocity_into(v, force, inverse_mass, dt, damping, gravity, v_star):
    """v* = (1 − c dt) v + dt (W f + g) [m/s], (n, 3) (eq. 6).

    Damping acts before the forces: the other way round it would bias the balance of springs and pressure by 1 − c dt.
    """
    keep = 1.0 - damping * dt
    for i in range(v.shape[0]):
        w = dt * inverse_mass[i]
        v_star[i, 0] = keep * v[i, 0] + w * force[i, 0] + dt * gravity[0]
        v_star[i, 1] = keep * v[i, 1] + w * force[i, 1] + dt * gravity[1]
        v_star[i, 2] = keep * v[i, 2] + w * force[i, 2] + dt * gravity[2]


@compiled
def prescribe_velocity_into(x, held_nodes, held_group, held_rest, displacement, dt, v_star):
    """v*_i = (X_i + d_g − x_i)/dt [m/s] for every held node: it ends the step where its attachment is (eq. 7)."""
    for h in range(held_nodes.shape[0]):
        i = held_nodes[h]
        g = held_group[h]
        for axis in range(3):
            v_star[i, axis] = (held_rest[h, axis] + displacement[g, axis] - x[i, axis]) / dt


@compiled
def volume_multiplier(motion, inverse_mass, volume_error, dt):
    """lam = [(V0 − V) − dt G·ṽ] / (dt² G·W̃·G) [Pa]: one division (eq. 8). Returns (lam, G·W̃·G).

    ṽ, W̃: velocity and inverse mass of a touched node act only along its obstacle (eq. 9). `volume_error` is V0 − V.
    Limit: with no gradient there is nothing to push on; the caller skips when G·W̃·G is not positive.
    """
    flow = 0.0
    mobility = 0.0
    for i in range(inverse_mass.shape[0]):
        g0, g1, g2 = motion.gradient[i, 0], motion.gradient[i, 1], motion.gradient[i, 2]
        flow += g0 * motion.v_star[i, 0] + g1 * motion.v_star[i, 1] + g2 * motion.v_star[i, 2]
        square = g0 * g0 + g1 * g1 + g2 * g2
        if motion.touched[i] > 0:
            n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
            along = g0 * n0 + g1 * n1 + g2 * n2
            v_along = motion.v_star[i, 0] * n0 + motion.v_star[i, 1] * n1 + motion.v_star[i, 2] * n2
            flow += along * (motion.approach[i] - v_along)
            square -= along * along
        mobility += inverse_mass[i] * square
    if not mobility > 0.0:
        return 0.0, mobility
    return (volume_error - dt * flow) / (dt * dt * mobility), mobility


@compiled
def steepest(gradient, inverse_mass):
    """max_i w_i |G_i| [m²/kg]: how far the node that moves most goes per unit of pressure and dt²."""
    largest = 0.0
    for i in range(inverse_mass.shape[0]):
        square = gradient[i, 0] ** 2 + gradient[i, 1] ** 2 + gradient[i, 2] ** 2
        largest = max(largest, inverse_mass[i] * math.sqrt(square))
    return largest


@compiled
def surely_short(volume_error, mobility, lightest, longest):
    """Whether no node moves farther than `longest` [m] to make up for a wrong volume: |e| √(max w / G·W̃·G) ≤ longest.

    max_i w_i |G_i| ≤ √(max w · G·W̃·G) without contact; the true reach is looked for only when this bound fails.
    """
    return volume_error * volume_error * lightest <= longest * longest * mobility


@compiled
def capped_error(volume_error, mobility, steepest, longest):
    """V0 − V, at most `longest` · G·W̃·G / max w|G| [m³]: then no node moves farther than `longest` [m] (eq. 35)."""
    most = longest * mobility / steepest if steepest > 0.0 else 0.0
    return min(max(volume_error, -most), most)


@compiled
def advance(motion, mass, inverse_mass, lam, dt, contact_impulse):
    """v⁺ = ṽ + dt lam W̃ G, x⁺ = x + dt v⁺ (eq. 10).

    Adds the impulse of each obstacle, n (m (a − n·v*) − dt lam n·G) [N s].
    """
    for i in range(mass.shape[0]):
        push = dt * lam * inverse_mass[i]
        u0 = motion.v_star[i, 0] + push * motion.gradient[i, 0]
        u1 = motion.v_star[i, 1] + push * motion.gradient[i, 1]
        u2 = motion.v_star[i, 2] + push * motion.gradient[i, 2]
        if motion.touched[i] > 0:
            o = motion.touched[i] - 1
            n0, n1, n2 = motion.normal[i, 0], motion.normal[i, 1], motion.normal[i, 2]
            kick = motion.approach[i] - (u0 * n0 + u1 * n1 + u2 * n2)
            u0 += kick * n0
            u1 += kick * n1
            u2 += kick * n2
            contact_impulse[o, 0] += mass[i] * kick * n0
            contact_impulse[o, 1] += mass[i] * kick * n1
            contact_impulse[o, 2] += mass[i] * kick * n2
        motion.v[i, 0], motion.v[i, 1], motion.v[i, 2] = u0, u1, u2
        motion.x[i, 0] += dt * u0
        motion.x[i, 1] += dt * u1
        motion.x[i, 2] += dt * u2


@compiled
def add_held_impulse(network, motion, lam, dt, gravity, held_impulse):
    """I_g = −dt Σ_i∈g (f_i + lam G_i + m_i g) [N s]: what an attachment gives to a body in slow motion (eq. 11)."""
    for h in range(network.held_nodes.shape[0]):
        i = network.held_nodes[h]
        g = network.held_group[h]
        for axis in range(3):
            inside = motion.force[i, axis] + lam * motion.gradient[i, axis] + network.mass[i] * gravity[axis]
            held_impulse[g, axis] -= dt * inside
