"""The lines of a cut in `make bench`: preparing its event, the event itself, and a step after it over one before."""

from collections.abc import Callable
from dataclasses import replace
from time import process_time_ns

import numpy as np

from massspring import Clock, ImplicitVolume, Setup, simulate
from massspring.run.stages import stages_of
from studies.bench.line import BenchLine
from studies.meshing.graded_mesh import MIDDLE, halved
from studies.meshing.scene_mesh import mesh_for
from studies.meshing.shaping import quadratic_mesh
from studies.metrics.timing.protocol import interleave, pinned
from studies.metrics.timing.statistics import ratio_with_spread
from studies.runs.case import BodyRecipe, Case
from studies.runs.prepare import prepared_on
from studies.scene.library.ball_incised import BALL_INCISED

LINEAR, VERTICES = 1_900, 380
"""Surface nodes of linear bodies, and surface vertices of the quadratic one: about 5,000 nodes in all."""
BODIES = {
    "one volume": BodyRecipe(nodes=LINEAR),
    "a volume per node": BodyRecipe(nodes=LINEAR, volumes="nodal"),
    "quadratic": BodyRecipe("quadratic", 4 * VERTICES - 6),
}
FRAMES, STEPS, REPEATS, ROUNDS = 24, 5, 7, 21
PREPARED, SWAP, SLOWER = 33.0, 1.0, 1.1
"""Promises: [ms] of an event in a run, a frame of video; [ms] of handing over positions and velocities; and a step
after the cut over one before."""


def cut_setup(body: BodyRecipe) -> Setup:
    """The incised ball, cut in the middle of a short run, on a mesh with evenly spread nodes. Raises StudyError."""
    if body.kind == "quadratic":
        mesh = quadratic_mesh(BALL_INCISED, *halved(BALL_INCISED, VERTICES, 0, 0, even=True), MIDDLE)
    else:
        mesh = mesh_for(BALL_INCISED, body.nodes, even=True)
    setup = prepared_on(Case(BALL_INCISED, body, ImplicitVolume(), dt_fraction=0.8), mesh).setup
    event = replace(setup.events[0], frame=FRAMES // 2)
    return replace(setup, clock=Clock(setup.clock.dt, FRAMES, STEPS), events=(event,))


def fastest_ms(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Processor time of the shortest of some repeats [ms]: what the machine does besides only adds."""
    times = []
    for _ in range(repeats):
        begin = process_time_ns()
        work()
        times.append(process_time_ns() - begin)
    return 1e-6 * min(times)


def cut_lines() -> list[BenchLine]:
    """Each body on one pinned core."""
    return [line for name, body in BODIES.items() for line in lines_of(name, cut_setup(body))]


def lines_of(name: str, setup: Setup) -> list[BenchLine]:
    """What its cut costs, prepared and not, and what its steps cost after it."""
    (after,), still = setup.later, replace(setup, events=())
    with pinned(threads=1):
        first, second = stages_of(setup)
        state = first.start
        for frame in range(second.frame):
            state = setup.method.advance(state, first.boundary(frame))
        nodes = setup.events[0].parent
        preparing = fastest_ms(lambda: stages_of(replace(setup)), 3)
        event = fastest_ms(lambda: second.entered(state))
        swap = fastest_ms(lambda: (state.x[nodes], state.v[nodes]))
        runs = {"before": still, "after": after}
        times = interleave({key: (lambda s=s: simulate(s).frame_ns) for key, s in runs.items()}, ROUNDS)
    # Other work on the machine only adds, so of each frame the shortest of all rounds counts.
    least = {key: np.min(frames[:, FRAMES // 4 :], axis=0) for key, frames in times.items()}
    ratio = float(least["after"].sum() / least["before"].sum())
    spread = ratio_with_spread(*(times[key][:, FRAMES // 4 :] for key in ("after", "before")))
    step = 1e-6 * float(np.min(least["before"])) / STEPS
    what = f"cut, {name}: "
    note = f"{setup.body.node_count} to {after.body.node_count} nodes"
    return [
        BenchLine(f"{what}its event in a run", event, "ms", PREPARED, note=note),
        BenchLine(f"{what}handing over positions and velocities", swap, "ms", SWAP),
        BenchLine(f"{what}set-up and states of both bodies", preparing, "ms", note="before the first frame"),
        BenchLine(
            f"{what}a step after it over one before",
            ratio,
            "1",
            SLOWER,
            note=f"{step:.3g} ms; medians of rounds {spread.low:.3g} to {spread.high:.3g}",
        ),
    ]
