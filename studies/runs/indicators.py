"""Indicators that a result is not reliable although the run ended well: a body that may lock, pressures that alternate
between neighbours, a force that varies while all loads are at rest, a volume that is not kept."""

import numpy as np
from scipy.sparse import csr_array

from massspring import Body, History
from massspring.body.points import PointVolumes
from massspring.body.volumes import Volumes
from studies.scene.kind import has_wall
from studies.scene.scene import Scene

ALTERNATES = 0.3
"""Bound of the alternation of pressures, over the shear modulus. Nodal volumes of pressed, clamped and sagging organs
have 0.3 to 12, quadratic bodies 0.05 to 0.25, the most if the mesh is coarse for the gradient of the pressure."""
SWAYS = 0.02
"""Bound of the variation of the force, over the force: about its middle a third of the target of the force. What a
swing does to displacements, SWINGS bounds."""
STILL_FRAMES = 20
"""Frames at the end of a run over which the variation of the force is measured."""
VOLUME_OFF = 1e-4
"""Bound of the error of all kept volumes together, which methods that keep volumes promise for a body that does not
turn. One that turns at omega [1/s] is (omega dt)² too large, because a step moves nodes along tangents."""
LOCKS = 2.0
"""Bound of the number of unknowns per kept volume. The continuum has three; one volume per tetrahedron gives 0.6."""


SHAKES, FEEDS = 0.003, 0.001
"""Energy that a body gains by itself, over its largest energy: bound of every run, and of one that swings while nothing
moves it. Sound runs gain up to 0.0006; a kidney between planes whose contact lags behind its volumes by a step gains
0.005 at 0.8 of the step limit and is 7 % wrong, at 0.6 of it 0.0015 and 2 %."""
WAVERS = 0.1
"""Of the kinetic energy: explicit steps keep the energy of a free swing within so much, to either side."""
SWINGS = 0.01
"""Bound of the swing at rest, and of the way to rest of a body that creeps: of displacements it is the target of the
mean error."""
SETTLES = 0.003
"""The second of a body heavier than its tissue, which promises the end of a lighter one. A ball that nearly topples
over the small cap that holds it is 0.116 from rest with 0.134, and 0.039 with 0.042; its swing is 0.011 and 0.003."""
SLOWEST = 0.9
"""Largest share of its way in one span that a body is taken to move in the next: with noise the ratio may be any."""
LESS = "halve the step, or take a method with a smaller tolerance"
"""What ends a gain: contact that answers a step late feeds energy in, and so does what multipliers leave of volumes."""
SHORTENED = 2.0
"""Bound of how many times shorter a load makes the steps."""
UNBALANCED = 0.03
"""Bound of the force that moves the body: the target of the force."""
HEAVIER = 1.0 + 1e-9
"""Heaviness above which inertia is more than the tissue's."""
LIGHTER = "take mass='stiffness', a body as heavy as its tissue"
CROSSED = 0.01
"""Bound of the share of the surface inside the body itself. The thin margin of a scanned liver under a plane folds into
itself by up to 0.002, which is said and no more; a cut that is pressed shut without contact does by 0.25."""
OUTLINES = {
    (True, False): ("force", 0.03),
    (True, True): ("force", 0.06),
    (False, False): ("displacement", 0.01),
    (False, True): ("displacement", 0.03),
}
"""Whether a load is a motion, or weight or a volume; whether the organ is hollow -> of what a part is missed at
outlines, and its bound: the target of its error."""
UNIFORM = 0.5
"""Factor on that bound for elements of one size: they may miss twice as much as is said, adaptive ones miss less. A
clamped ball of 594 nodes is 6.5 % off at 0.017."""
MOVES, PACE = 1e-3, 0.02
"""Kinetic energy over the largest energy from which a run shows a motion, and bound of the error of its pace."""


def indicators(scene: Scene, body: Body, history: History, lumen: int, keeps: bool, steps: int) -> dict[str, float]:
    """Attributes of a run (RUN_ATTRIBUTES); NaN if they do not apply. lumen: column of the lumen, or −1; keeps: whether
    the method claims to keep volumes; steps: of a frame at rest."""
    pressure = history.pressure[history.good_frames - 1] if history.good_frames else history.pressure[:0]
    alternation = unlike_neighbours(pressure, neighbours(body.kept, lumen)) if len(pressure) else np.nan
    return {
        "unknowns_per_volume": 3.0 * body.node_count / body.kept.count,
        "alternation": float(alternation / scene.tissue.shear_modulus),
        "volume_off": volume_off(history) if keeps else np.nan,
        "sway": sway(scene, history.t[: history.good_frames], history.contact_force, history.held_force),
        "gained": gained(history),
        "swing": swing(scene, history),
        "pace": pace(history),
        "heaviness": float(body.moved_mass.sum() / body.mass.sum()),
        "unbalanced": unbalanced(scene, body, history),
        "unsettled": unsettled(scene, body, history),
        "shortened": float(history.steps.max()) / steps,
    }


def largest_energy(history: History) -> float:
    """Of the body, or work that it took where that is known [J]; NaN without a frame."""
    sizes = history.kinetic + history.elastic, np.abs(history.work)
    return float(np.nanmax(sizes)) if history.good_frames else float("nan")


def gained(history: History) -> float:
    """Largest rise of kinetic + elastic energy less the work done on the body, over its largest energy [1]: damping and
    friction can only lower it. WAVERS of the largest kinetic energy is not counted. NaN where the work is unknown."""
    balance = np.concatenate([[0.0], history.kinetic + history.elastic - history.work])[: history.good_frames + 1]
    wavers = WAVERS * float(history.kinetic[: history.good_frames].max(initial=0.0))
    rise = float((balance - np.minimum.accumulate(balance)).max())
    return max(rise - wavers, 0.0 * rise) / (largest_energy(history) or np.inf)


def swing(scene: Scene, history: History) -> float:
    """Root of the kinetic over the largest energy in the last quarter of the frames in which all loads are at rest [1],
    about the share of its displacement by which the body still moves; NaN where no frame is at rest."""
    t = history.t[: history.good_frames]
    still = np.flatnonzero(t > still_from(scene))
    last = still[-min(STILL_FRAMES, max(1, len(still) // 4)) :]
    most = largest_energy(history)
    return float(np.sqrt(history.kinetic[last].max() / (most or np.inf))) if len(still) else float("nan")


def pace(history: History) -> float:
    """How many times as fast as with the masses of the tissue the body moves when it moves most [1] (Rayleigh's
    quotient of its velocities); 1 for a run through equilibria, which shows no motion."""
    if not history.good_frames or not np.nanmax(history.kinetic) > MOVES * largest_energy(history):
        return 1.0
    most = int(np.nanargmax(history.kinetic))
    return float(np.sqrt(history.tissue_kinetic[most] / history.kinetic[most]))


def unbalanced(scene: Scene, body: Body, history: History) -> float:
    """Largest sum of the forces of obstacles, held regions and weight at a checkpoint, over the largest probed force:
    what accelerates the body and overcomes its drag instead of deforming it [1]; NaN where no force is compared."""
    ends = [int(np.argmin(np.abs(history.t - t))) for t in scene.checkpoints]
    ends = [frame for frame in ends if frame < history.good_frames]
    if not (compares_force(scene, history.contact_force, history.held_force) and ends):
        return float("nan")
    outer = history.contact_force.sum(axis=1) + history.held_force.sum(axis=1)
    left = np.linalg.norm(outer[ends] + body.mass.sum() * np.asarray(scene.gravity), axis=1)
    force = np.abs(scene.output_force(history.contact_force, history.held_force)[: history.good_frames])
    return float(left.max() / (force.max() or np.inf))


def resting_frames(scene: Scene, t: np.ndarray) -> list[int]:
    """Numbers (1 … F) of three frames at equal distances, the last at the end `t` (F,) [s]; the second half of the time
    for which all loads rest. Empty if that is shorter than four frames."""
    still = int((t > still_from(scene)).sum())
    return [len(t) - 2 * (still // 4), len(t) - still // 4, len(t)] if still >= 4 else []


def unsettled(scene: Scene, body: Body, history: History) -> float:
    """Mean way of the nodes of a held body from where they are to where they will come to rest, over its largest
    displacement [1]; NaN where no load rests, and for a free body, which may drift for ever.

    What a body that creeps moves in the last span is q times what it moves in the one before, and in all later ones
    together q/(1 − q) times as much (Aitken 1926). Where that is less, and of a swing, it is the way in the last span.
    """
    frames = resting_frames(scene, history.t)
    if not scene.held or not frames or not np.isin(frames, history.snapshot_frames).all():
        return float("nan")
    before, middle, end = history.snapshots[np.searchsorted(history.snapshot_frames, frames)]
    earlier, later = middle - before, end - middle
    q = float((earlier * later).sum() / ((earlier**2).sum() or np.inf))
    q = min(max(q, 0.5), SLOWEST)
    way, moved = (np.linalg.norm(x, axis=1) for x in (later, end - body.rest))
    return float(way.mean() * q / (1.0 - q) / (moved.max() or np.inf))


def remarks(scene: Scene, signs: dict[str, float], uniform: bool = False) -> list[str]:
    """A sentence for each indicator of a run in a scene that is beyond its bound; uniform: whether a quadratic body has
    elements of one size."""
    lines = []
    if signs["unknowns_per_volume"] < LOCKS:
        each = signs["unknowns_per_volume"]
        lines.append(f"there are {each:.2g} unknowns for each kept volume; below {LOCKS:g} a body locks, keep fewer")
    if signs["alternation"] > ALTERNATES:
        part = signs["alternation"]
        lines.append(
            f"pressures alternate by {part:.2g} of the shear modulus between neighbouring volumes; smooth them"
        )
    if signs["sway"] > SWAYS:
        percent = 100 * signs["sway"]
        lines.append(
            f"the force oscillates by {percent:.2g} % at the end while nothing outside moves; {way_out(signs)}"
        )
    if signs["swing"] > SWINGS and not signs["unsettled"] > signs["swing"]:
        percent = 100 * signs["swing"]
        lines.append(f"the body swings by {percent:.2g} % at the end while nothing outside moves; {way_out(signs)}")
    elif signs["unsettled"] > (SETTLES if signs["heaviness"] > HEAVIER else SWINGS):
        percent = 100 * signs["unsettled"]
        out = way_out(signs, "give the scene more time at rest, or less damping")
        lines.append(f"at the end the body creeps, {percent:.2g} % from where it will rest; {out}")
    if abs(signs["pace"] - 1.0) > PACE:
        share, how = 100 * abs(signs["pace"] - 1.0), "fast" if signs["pace"] > 1.0 else "slow"
        lines.append(f"the motion is {share:.0f} % too {how}, by masses that are not the tissue's; take mass='lumped'")
    if signs["unbalanced"] > UNBALANCED:
        percent = 100 * signs["unbalanced"]
        lines.append(
            f"on the way up to {percent:.2g} % of the force moves the body instead of deforming it; "
            f"{LIGHTER if signs['heaviness'] > HEAVIER else 'load more slowly, or with less damping'}"
        )
    if signs["volume_off"] > VOLUME_OFF:
        lines.append(
            f"the kept volume is up to {100 * signs['volume_off']:.2g} % off (bound {100 * VOLUME_OFF:g} %); a body "
            "that turns at omega is (omega dt)² too large: halve the step for a quarter of it"
        )
    moved = not any(scene.gravity) and "force" in scene.quantities
    what, bound = OUTLINES[moved, has_wall(scene)]
    if signs["missed_at_outlines"] > (UNIFORM * bound if uniform else bound):
        lines.append(
            f"elements are coarse where held tissue or contact ends: the {what} may be about "
            f"{100 * signs['missed_at_outlines']:.2g} % off; use more nodes, or a quadratic body with graded='adaptive'"
        )
    if 0.0 < signs["crossed"] <= CROSSED:
        lines.append(through_itself(signs["crossed"]))
    if signs["shortened"] > SHORTENED:
        times = signs["shortened"]
        lines.append(
            f"to stay stable under the load, steps are up to {times:.2g} times shorter than at rest; frames take longer"
        )
    return lines


def through_itself(share: float) -> str:
    """On a share of the surface [1] that lies inside the body."""
    return (
        f"up to {100 * share:.2g} % of the surface lies inside the body: no force acts where an organ touches itself, "
        "except between the faces of a cut with contact=True"
    )


def volume_off(history: History) -> float:
    """Largest |V/V0 − 1| [1] of all kept volumes together after any good frame; NaN without one."""
    volume, target = (values[: history.good_frames].sum(axis=1) for values in (history.volume, history.volume_target))
    return float(np.abs(volume / target - 1.0).max(initial=0.0)) if len(volume) else float("nan")


def way_out(signs: dict[str, float], time: str = "give the scene more damping or more time at rest") -> str:
    """What ends an oscillation: that of a sound run decays in `time`."""
    if signs["gained"] > FEEDS:
        return LESS
    return LIGHTER if signs["heaviness"] > HEAVIER else time


def neighbours(kept: Volumes | PointVolumes, lumen: int) -> np.ndarray:
    """Pairs of volumes of the tissue that share an element or a triangle, (e, 2)."""
    if isinstance(kept, PointVolumes):
        corner = np.asarray(kept.corner_volume)
        pairs = np.concatenate([corner[:, [i, j]] for i in range(4) for j in range(i)])
    else:
        shares = csr_array(kept.share != 0).astype(np.int64)
        together = (shares @ shares.T).tocoo()
        pairs = np.column_stack([together.row, together.col])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    return pairs[(pairs[:, 0] != pairs[:, 1]) & ~(pairs == lumen).any(axis=1)]


def unlike_neighbours(pressure: np.ndarray, pairs: np.ndarray) -> float:
    """Root mean square difference of `pressure` (m,) from the mean of its neighbours, `pairs` (e, 2), in its unit.

    It is small for a gradient, and twice the amplitude for a checkerboard. NaN without pairs.
    """
    if not len(pairs):
        return float("nan")
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    count = np.bincount(own, minlength=len(pressure))
    around = np.bincount(own, pressure[other], minlength=len(pressure))
    paired = count > 0
    return float(np.sqrt(np.mean((pressure[paired] - around[paired] / count[paired]) ** 2)))


def sway(scene: Scene, t: np.ndarray, contact_force: np.ndarray, held_force: np.ndarray) -> float:
    """Range of the probed force about its straight trend, over its mean [1], over the last frames in which all loads
    are at rest; NaN if there are fewer than three, or no force to compare.

    t: ends of the good frames [s], (f,); contact_force: (F, o, 3) [N], held_force: (F, g, 3) [N], F ≥ f.
    """
    last = np.flatnonzero(t > still_from(scene))[-STILL_FRAMES:]
    if len(last) < 3 or not compares_force(scene, contact_force, held_force):
        return float("nan")
    force = scene.output_force(contact_force, held_force)[last]
    trend, mean = np.polynomial.Polynomial.fit(last, force, 1), abs(float(force.mean()))
    return float(np.ptp(force - trend(last))) / mean if mean > 0.0 else float("nan")


def compares_force(scene: Scene, contact_force: np.ndarray, held_force: np.ndarray) -> bool:
    """Whether the scene compares a force, and the histories (F, o, 3) and (F, g, 3) have it."""
    among = contact_force if scene.probed.what == "obstacle" else held_force
    return "force" in scene.quantities and scene.probed.number < among.shape[1]


def still_from(scene: Scene) -> float:
    """Time at which all paths and the filling of a scene have ended [s]; infinity for a scene that starts in motion."""
    if scene.start is not None:
        return float("inf")
    paths = [moving.path.times for moving in (*scene.obstacles, *scene.held)]
    filling = [scene.lumen.filling.times] if scene.lumen is not None else []
    return max((times[-1] for times in (*paths, *filling) if len(times)), default=0.0)
