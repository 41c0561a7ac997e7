"""Steps of frames under load against the largest frequency of the loaded body's stiffness matrix."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from massspring import ImplicitVolume, Setup, make_clock, quadratic_body, simulate, step_limit
from massspring.analysis.stiffness import local_stiffness, point_hessian, spring_stiffness
from massspring.run.loaded_steps import LoadedSteps
from tests.massspring.quadratic import SOFT, quadratic_block

SHARE, FRAME = 0.8, 0.1
BODY = quadratic_body(*quadratic_block((3, 2, 2), 0.02, 0.0), SOFT)
LIMIT = step_limit(BODY, 5.0)
SETUP = Setup(BODY, ImplicitVolume(), make_clock(FRAME, 1, SHARE * LIMIT.damped, LIMIT), damping=5.0)


def squeezed(height: float):
    """The state of uniaxial compression to `height` over the height at rest, with its pressure p = mu/height."""
    start = SETUP.start()
    x = BODY.rest * np.array([height**-0.5, height**-0.5, height])
    start.rows.eased[:] = BODY.rest_pressure / height
    return replace(start.moved_to(x), lam=np.full_like(start.lam, BODY.rest_pressure * (1.0 / height - 1.0))), x


@pytest.mark.parametrize("height", [1.0, 0.8, 0.5])
def test_steps_follow_the_largest_frequency_of_the_loaded_body(height):
    state, x = squeezed(height)
    mu, p = BODY.rest_pressure, BODY.rest_pressure / height
    bulk = BODY.local_bulk + 2.0 / 3.0 * (p - mu)
    pressure = np.full(BODY.kept.weight.shape, p)
    stiffness = spring_stiffness(BODY, x) - point_hessian(BODY.kept, x, pressure) + local_stiffness(BODY.kept, bulk, x)
    root = diags_array(np.repeat(BODY.moved_mass**-0.5, 3))
    frequency = np.sqrt(eigsh(root @ stiffness @ root, 1, which="LA", return_eigenvectors=False)[0])
    steps = LoadedSteps(SETUP, SETUP.start())
    for _ in range(10):
        taken = steps.needed(state)
    wanted = FRAME / (SHARE * replace(LIMIT, frequency=frequency).damped)
    assert taken == pytest.approx(wanted, rel=0.02, abs=1.0)
    assert height > 0.5 or taken > SETUP.clock.steps  # the load matters


def counted(watch: LoadedSteps, states) -> tuple[np.ndarray, int]:
    """The steps that a watch of loads wants after frames that end at `states`, and how often it counted them."""
    calls, needed = [], watch.needed
    watch.needed = lambda state: calls.append(state) or needed(state)
    wanted = []
    for state in states:
        stage = SimpleNamespace(setup=SimpleNamespace(method=SimpleNamespace(advance=lambda *_, state=state: state)))
        watch.advanced(stage, state, 0, None)
        wanted.append(watch.counted)
    return np.array(wanted), len(calls)


def test_steps_are_counted_again_only_where_the_load_is_another():
    """A slow compression, a rest, and a load that comes at once: as safe as a count after every frame."""
    slow = [squeezed(height)[0] for height in np.linspace(1.0, 0.5, 101)]
    states = [*slow, *[slow[-1]] * 100, slow[0], slow[-1], slow[-1]]
    watch, always = LoadedSteps(SETUP, SETUP.start()), LoadedSteps(SETUP, SETUP.start())
    always._differs = lambda state: True
    (wanted, calls), (best, frames) = counted(watch, states), counted(always, states)
    assert (wanted >= 0.97 * best - 1).all() and wanted.max() > SETUP.clock.steps
    assert calls < 0.5 * frames


def test_a_clock_without_a_limit_keeps_its_steps():
    setup = replace(SETUP, clock=replace(SETUP.clock, limit=None))
    assert LoadedSteps(setup, setup.start()).needed(squeezed(0.5)[0]) == setup.clock.steps


def test_single_precision_takes_as_many_steps():
    """Its kernels write single numbers: handed doubles they would write beyond their arrays."""
    single = replace(SETUP, precision="float32")
    watch = LoadedSteps(single, single.start())
    assert watch.needed(single.start()) == pytest.approx(SETUP.clock.steps, abs=1)
    history = simulate(single)
    assert history.outcome == "finished" and history.steps[0] == pytest.approx(SETUP.clock.steps, abs=1)
