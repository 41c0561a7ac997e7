"""What does not fit the scene is refused with the reason: another mesh, unit or order, missing steps, no numbers."""

import numpy as np
import pytest

from studies.base.errors import StudyError
from studies.exchange.judge import entry_record, judge
from tests.studies.exchange.handed_in import NODES
from tests.studies.octant import SCENE


def sentence_of(path, folder) -> str:
    """With which it is refused; nothing is written."""
    with pytest.raises(StudyError) as refused:
        judge(SCENE, path, folder / "none", nodes=NODES)
    assert not (folder / "none").exists()
    return str(refused.value)


def wrong(ours, which):
    x = ours.positions.copy()
    if which == "nan":
        x[7, 5, 1] = np.nan
    elif which == "permuted":
        x[:, [3, 9]] = x[:, [9, 3]]
    elif which == "both":
        x = 1e3 * x[:, ::-1]
    elif which == "steps in mm":
        x[1:] *= 1e3
    elif which == "late displacements":
        x[1:] -= x[0]
    elif which == "shrunk":  # a body that has lost its volume is judged
        x[1:] *= 0.3
    elif which == "burst":
        x[9, 5, 1] = 1e300
    return {
        "mm": 1e3 * x,
        "inch": x / 0.0254,
        "moved": x + 0.002,
        "few": x[:, :-1],
        "displacements": x - x[0],
        "flat": x[..., :2],
        "complex": x + 0.0j,
    }.get(which, x)


POSITIONS = {
    "mm": "the rest positions are those of straight.vtu in millimetres; hand them in in metres",
    "inch": "those of straight.vtu in inches",
    "both": "those of straight.vtu in millimetres",
    "permuted": "the nodes are those of straight.vtu in another order (number 3 is its number 9)",
    "moved": "the positions at t = 0 are up to 0.00346 m from those of straight.vtu",
    "displacements": "are all zero, so these are displacements; add the rest positions of straight.vtu",
    "late displacements": "and not of its form; if these are displacements, add the rest positions to all steps",
    "few": "positions of 187 nodes, but straight.vtu 188 and curved.vtu 1112 at this number of vertices",
    "nan": "positions of node 5 at t = 0.7 s is not a finite number",
    "steps in mm": "times the size of the body; hand in all steps in metres",
    "burst": "a node at t = 0.9 s is 1e+300 m from its place at rest",
    "complex": "positions holds complex numbers",
    "flat": "positions have shape (41, 188, 2); they must be (steps, nodes, 3)",
}


@pytest.mark.parametrize("which", POSITIONS)
def test_positions_that_do_not_fit_are_refused_with_the_reason(ours, tmp_path, which):
    path = ours.npz(tmp_path / "a.npz", positions=wrong(ours, which))
    assert POSITIONS[which] in sentence_of(path, tmp_path)


HISTORIES = {
    "missing steps": (lambda o: {"t": o.t[:30], "positions": o.positions[:30]}, "steps are missing at t = 4 s"),
    "no rest": (lambda o: {"t": o.t[1:], "positions": o.positions[1:]}, "missing at t = 0 s (t = 0 is the rest shape)"),
    "milliseconds": (lambda o: {"t": 1e3 * o.t}, "the times go to 4000, the scene to 4 s: give seconds, not ms"),
    "descending": (lambda o: {"t": o.t[::-1]}, "must be increasing numbers"),
    "no times": (lambda o: {"t": None}, "a.npz lacks 't'"),
    "other names": (
        lambda o: {"t": None, "time": o.t, "x": o.positions},
        "a.npz lacks 't'; it needs t (F) and positions (F, n, 3), and holds positions, force, pressure, time, x",
    ),
    "short force": (lambda o: {"force": o.force[:-1]}, "force has shape (40,) for 41 steps"),
    "force nan": (lambda o: {"force": np.where(o.t == 2.0, np.nan, o.force)}, "force at t = 2 s is not a finite"),
    "no steps": (lambda o: {"t": o.t[:0], "positions": o.positions[:0]}, "a.npz holds no steps; hand in rest and"),
    "too late": (
        lambda o: {"t": np.append(o.t, 9.0), "positions": np.append(o.positions, o.positions[-1:], axis=0)},
        "the last step is at t = 9 s, after the scene ends at 4 s",
    ),
    "other times": (lambda o: {"t": o.t[:5]}, "41 steps for 5 times"),
}


@pytest.mark.parametrize("what", HISTORIES)
def test_times_and_forces_that_do_not_fit_are_refused(ours, tmp_path, what):
    change, message = HISTORIES[what]
    short = {"force": None, "pressure": None} if "positions" in change(ours) else {}
    assert message in sentence_of(ours.npz(tmp_path / "a.npz", **short | change(ours)), tmp_path)


@pytest.mark.parametrize("double", [False, True])
def test_a_body_that_shrinks_is_judged_and_a_force_twice_at_one_time_is_not(ours, tmp_path, double):
    path, force = ours.npz(tmp_path / "a.npz", positions=wrong(ours, "shrunk"), force=None), tmp_path / "f.csv"
    rows = [f"{t:.17g},1.0" for t in ours.t] + ["2.0,3.0"] * double
    force.write_text("\n".join(["t,force", *rows]))
    if double:
        with pytest.raises(StudyError, match=r"f\.csv has several forces at t = 2 s; give one"):
            entry_record(SCENE, path, "theirs", NODES, force)
    else:
        assert entry_record(SCENE, path, "theirs", NODES, force).fields["t"].values[-1] == 4.0
