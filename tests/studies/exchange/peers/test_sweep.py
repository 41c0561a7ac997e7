"""The settings of programs are those that the published sweep found to be best."""

from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from studies.exchange.peers import sweep
from studies.exchange.peers.contest import PEERS
from studies.exchange.peers.sweep import SHARE, best
from studies.metrics.judged import Measured
from studies.store.record import Status

TABLE = Path(__file__).parents[4] / "results" / "published" / "league" / "sweep.csv"


def test_the_best_has_the_smallest_share_and_must_have_ended_well():
    rows = [
        {"settings": "{}", SHARE: 4.0},
        {"settings": '{"a": 1}', SHARE: 3.0},
        {"settings": "{}", SHARE: float("nan")},
    ]
    assert best(rows) == {"a": 1} and best(rows[2:]) is None and best([{"settings": "{}"}]) is None


@pytest.mark.parametrize(
    ("force", "displacement", "volume", "share"), [(-6.0, 0.5, 0.1, 2.0), (3.0, 4.0, 1.0, 4.0), (3.0, 1.0, 8.0, 8.0)]
)
def test_lost_volume_counts_as_much_as_force_and_displacement(monkeypatch, force, displacement, volume, share):
    """Else a tissue that gives way would be the best setting of coarse tetrahedra."""
    found = SimpleNamespace(force=Measured(force), displacement=Measured(displacement), cost=Measured(1.0))
    monkeypatch.setattr(sweep, "run_of_entry", lambda *_: "run")
    monkeypatch.setattr(sweep, "judged_run", lambda run: found)
    monkeypatch.setattr(sweep, "VOLUME", lambda run: volume)
    assert sweep._numbers(SimpleNamespace(status=Status.OK, message=""))[SHARE] == pytest.approx(share)


@pytest.mark.parametrize("name", ["bullet", "drake", "mujoco", "newton", "sfepy"])
def test_programs_run_with_the_best_of_the_published_sweep(name):
    rows = pd.read_csv(TABLE).query("engine == @name").to_dict("records")
    (peer,) = [peer for peer in PEERS if peer.name == name]
    assert len(rows) >= 3 and best(rows) == dict(peer.settings)
