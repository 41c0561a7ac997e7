"""What an update of 1 ms costs: mass-spring bodies and implicit elements on coarse bodies that are less accurate."""

from dataclasses import replace

from massspring import Clock, ImplicitElements, ImplicitVolume, Method, Setup, simulate
from studies.bench.line import BenchLine
from studies.metrics.timing.protocol import interleave, pinned
from studies.metrics.timing.statistics import kernel_ns, ratio_with_spread
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import prepare
from studies.scene.library.ball_clamped import BALL_CLAMPED

UPDATE = 0.001
"""Simulated time between two states that a program asks for [s], one step of any of them."""
UPDATES, ROUNDS = 40, 5
QUADRATIC = BodyRecipe("quadratic", 594, contact="nodes")
PAIRS = {
    "linear, coarse": (BodyRecipe(nodes=150, law="cotangent", volumes="nodal"), BodyRecipe(nodes=300)),
    "quadratic, coarse": (replace(QUADRATIC, nodes=294), QUADRATIC),
    "the same body": (QUADRATIC, QUADRATIC),
}
"""Words of the line -> what implicit elements advance, and a mass-spring body with a smaller mean error in this scene:
5.3 beside 8.9 %, 1.7 beside 3.5 % (study accuracy)."""
FASTER = 20.0
"""Promise: how many times as long implicit elements take."""


def update_setup(body: BodyRecipe, method: Method) -> Setup:
    """The ball held at both caps while the upper one comes down, a frame of one step for each update."""
    setup = prepare(Case(BALL_CLAMPED, body, method, dt=UPDATE)).setup
    return replace(setup, clock=Clock(UPDATE, UPDATES, 1))


def element_lines() -> list[BenchLine]:
    """Updates of implicit elements over those of mass-spring bodies, in turns on one pinned core."""
    setups = {f"springs, {body.nodes}": update_setup(body, ImplicitVolume()) for _, body in PAIRS.values()}
    setups |= {name: update_setup(body, ImplicitElements()) for name, (body, _) in PAIRS.items()}
    with pinned():
        times = interleave({name: (lambda s=s: simulate(s).frame_ns) for name, s in setups.items()}, ROUNDS)
    times = {name: ns[:, UPDATES // 4 :] for name, ns in times.items()}
    lines = []
    for name, (_, body) in PAIRS.items():
        springs = f"springs, {body.nodes}"
        ratio = ratio_with_spread(times[name], times[springs])
        mine, theirs = (1e-6 * kernel_ns(times[which]) for which in (springs, name))
        note = f"{theirs:.3g} over {mine:.3g} ms; {setups[name].body.node_count} and "
        note += f"{setups[springs].body.node_count} nodes; rounds {ratio.low:.3g} to {ratio.high:.3g}"
        what = f"1 ms of implicit elements, {name}, over a mass-spring body that is as accurate"
        lines.append(BenchLine(what, ratio.median, "1", FASTER, at_most=False, note=note))
    return lines
