"""Friction of long steps, node by node: who slides, who sticks, and what rubs it (eq. 12.4)."""

import numpy as np
import pytest

from massspring import Clock, ImplicitSprings, Plane, Setup, Trajectory
from massspring.kernels.contact.node_contact import SLIDES, STICKS
from massspring.methods.implicit.contact import SLIP_RESOLUTION, ActiveSet, Contact

DT, MU = 5e-3, 0.5
BELOW = 1e-3
CARRIED = np.array([0.3, -0.2, 0.0])
ALONG = Trajectory((0.0, 1.0), ((0.0, 0.0, 0.0), tuple(CARRIED)))


class Sole:
    """A block that falls onto a rough floor which moves along itself: the nodes of its sole stick at first."""

    def __init__(self, body) -> None:
        floor = Plane((0, 0, float(body.rest[:, 2].min()) - BELOW), (0, 0, 1), ALONG, MU)
        fall = np.tile([0.0, 0.0, -1.0], (body.node_count, 1))
        setup = Setup(body, ImplicitSprings(), Clock(DT, 1, 1), (floor,), velocity=fall)
        state, self.boundary = setup.start(), setup.boundary(0)
        self.state, self.model, self.contacts = state, state.model, state.contacts
        self.factor = state.memory.at(self.model, DT, 0.0)
        self.contact = Contact(self.model, state.nodes, self.contacts, self.boundary, 0)
        self.nodes = np.flatnonzero(self.contacts.mode == STICKS)
        self.place = (floor.point[2] - self.state.nodes.x[self.nodes, 2]) / DT
        """Speed [m/s] that ends the step on the floor."""

    def active(self) -> ActiveSet:
        return ActiveSet(self.factor, self.state.nodes, self.contacts, self.model.surface_nodes, DT)

    def slide(self) -> None:
        self.contacts.mode[self.nodes] = SLIDES
        self.contacts.v_target[self.nodes, :2] = 0.0

    def end(self, slip: np.ndarray) -> np.ndarray:
        """Where nodes end that slip on the floor by so much [m/s]."""
        end = self.state.nodes.x.copy()
        end[self.nodes] += DT * (CARRIED + slip)
        return end


@pytest.fixture
def sole(block_body):
    return Sole(block_body)


@pytest.mark.parametrize(("impulse", "slips"), [(0.98 * MU, False), (1.02 * MU, True)])
def test_a_node_sticks_up_to_what_its_friction_can_take(sole, impulse, slips):
    active, (first, *others) = sole.active(), sole.nodes
    impulses = np.zeros((len(active.nodes) // 3, 3))
    assert np.array_equal(active.nodes[::3], sole.nodes)
    impulses[:] = (0.1 * MU, 0.0, 1.0)
    impulses[0] = (0.0, impulse, 1.0)
    changed = sole.contact.revise(sole.end(np.zeros(3)), active, impulses.ravel())
    assert changed == slips
    assert sole.contacts.mode[first] == (SLIDES if slips else STICKS)
    assert (sole.contacts.mode[others] == STICKS).all()
    # Up to the floor within the step; along it with the floor, or freely.
    expected = [*(0.0 * CARRIED[:2] if slips else CARRIED[:2]), sole.place[0]]
    assert np.allclose(sole.contacts.v_target[first], expected, rtol=0, atol=1e-12)
    slipping = [0.0, MU, 0.0] if slips else [0.0, 0.0, 0.0]
    assert np.allclose(sole.contact.friction_impulse[first], slipping, rtol=0, atol=1e-15)


def test_friction_acts_against_the_slip(sole):
    """By mu times what the floor pushes, and that is never less than nothing."""
    sole.slide()
    active, slip = sole.active(), np.array([-0.03, 0.04, 0.0])
    impulses = np.linspace(-1.0, 2.0, len(sole.nodes))
    assert not sole.contact.apply_friction(sole.end(slip), active, impulses)
    expected = -MU * np.maximum(impulses, 0.0)[:, None] * slip / 0.05
    # Round-off of a way of 0.25 mm is 1e-17 m.
    assert np.abs(sole.contact.friction_impulse[sole.nodes] - expected).max() < 1e-11
    assert (sole.contacts.mode[sole.nodes] == SLIDES).all()


def test_what_friction_would_drive_sticks(sole):
    """A node that goes the way its friction of the last pass points is carried along, without friction."""
    sole.slide()
    first, *others = sole.nodes
    slip = np.array([-0.03, 0.04, 0.0])
    sole.contact.friction_impulse[sole.nodes] = -slip
    sole.contact.friction_impulse[first] = slip
    assert sole.contact.apply_friction(sole.end(slip), sole.active(), np.ones(len(sole.nodes)))
    assert sole.contacts.mode[first] == STICKS and (sole.contacts.mode[others] == SLIDES).all()
    assert (sole.contact.friction_impulse[first] == 0).all()
    assert np.allclose(sole.contacts.v_target[first, :2], CARRIED[:2], rtol=0, atol=1e-15)


@pytest.mark.parametrize(("way", "sticks"), [(0.0, True), (0.5, True), (2.0, False)])
def test_a_slip_that_is_round_off_is_none(sole, way, sticks):
    """Just below and just above the bound: its direction would be chance, and its friction as large as any."""
    sole.slide()
    slip = np.array([0.6, -0.8, 0.0]) * way * SLIP_RESOLUTION * sole.model.correction_limit / DT
    sole.state.nodes.x[sole.nodes] = 0.0  # at the origin, where positions resolve so small a way
    carried = sole.boundary.velocity[0, 0]
    carried[:] = 0.0
    end = sole.state.nodes.x.copy()
    end[sole.nodes] = DT * slip
    assert sole.contact.apply_friction(end, sole.active(), np.ones(len(sole.nodes))) == sticks
    assert (sole.contacts.mode[sole.nodes] == (STICKS if sticks else SLIDES)).all()
    assert np.linalg.norm(sole.contact.friction_impulse, axis=1).max() == pytest.approx(0.0 if sticks else MU, rel=1e-9)
