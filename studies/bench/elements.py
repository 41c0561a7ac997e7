"""What an update of 1 ms costs: the quadratic mass-spring body beside implicit elements on coarse bodies."""

from dataclasses import replace

from massspring import Clock, ImplicitElements, ImplicitVolume, Method, Setup, simulate
from studies.bench.line import BenchLine
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import prepare
from studies.scenes.ball_clamped import BALL_CLAMPED
from studies.timing.protocol import interleave, pinned
from studies.timing.statistics import kernel_ns, ratio_with_spread

UPDATE = 0.001
"""Simulated time between two states that a program asks for [s], one step of any of them."""
UPDATES, ROUNDS = 40, 5
QUADRATIC = BodyRecipe("quadratic", 594, contact="nodes")
COARSE = {
    "linear, coarse": BodyRecipe(nodes=150, law="cotangent", volumes="nodal"),
    "quadratic, coarse": replace(QUADRATIC, nodes=294),
    "the same body": QUADRATIC,
}
"""What implicit elements advance, words of the line -> body."""
FASTER = 20.0
"""Promise: how many times as long implicit elements take, where they are quadratic."""


def update_setup(body: BodyRecipe, method: Method) -> Setup:
    """The ball held at both caps while the upper one comes down, a frame of one step for each update."""
    setup = prepare(Case(BALL_CLAMPED, body, method, dt=UPDATE)).setup
    return replace(setup, clock=Clock(UPDATE, UPDATES, 1))


def element_lines() -> list[BenchLine]:
    """Updates of implicit elements over those of the quadratic body, in turns on one pinned core."""
    setups = {"springs": update_setup(QUADRATIC, ImplicitVolume())}
    setups |= {name: update_setup(body, ImplicitElements()) for name, body in COARSE.items()}
    with pinned():
        times = interleave({name: (lambda s=s: simulate(s).frame_ns) for name, s in setups.items()}, ROUNDS)
    times = {name: ns[:, UPDATES // 4 :] for name, ns in times.items()}
    lines = []
    for name, body in COARSE.items():
        ratio = ratio_with_spread(times[name], times["springs"])
        mine, theirs = (1e-6 * kernel_ns(times[which]) for which in ("springs", name))
        note = f"{theirs:.3g} over {mine:.3g} ms; {setups[name].body.node_count} and "
        note += f"{setups['springs'].body.node_count} nodes; rounds {ratio.low:.3g} to {ratio.high:.3g}"
        target = FASTER if body.kind == "quadratic" else None
        what = f"1 ms of implicit elements, {name}, over the quadratic body"
        lines.append(BenchLine(what, ratio.median, "1", target, at_most=False, note=note))
    return lines
