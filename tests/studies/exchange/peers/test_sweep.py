"""The settings of programs are those that the published sweep found to be best."""

from pathlib import Path

import pandas as pd
import pytest

from studies.exchange.peers.contest import PEERS
from studies.exchange.peers.sweep import SHARE, best

TABLE = Path(__file__).parents[4] / "results" / "published" / "league" / "sweep.csv"


def test_the_best_has_the_smallest_share_and_must_have_ended_well():
    rows = [
        {"settings": "{}", SHARE: 4.0},
        {"settings": '{"a": 1}', SHARE: 3.0},
        {"settings": "{}", SHARE: float("nan")},
    ]
    assert best(rows) == {"a": 1} and best(rows[2:]) is None and best([{"settings": "{}"}]) is None


@pytest.mark.parametrize("name", ["drake", "mujoco", "newton"])
def test_programs_run_with_the_best_of_the_published_sweep(name):
    rows = pd.read_csv(TABLE).query("engine == @name").to_dict("records")
    (peer,) = [peer for peer in PEERS if peer.name == name]
    assert len(rows) >= 2 and best(rows) == dict(peer.settings)
