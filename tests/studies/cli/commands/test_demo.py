"""`organbench demo`: three bodies with their speeds, and a page that names its own results folder."""

import re
from pathlib import Path

import numpy as np
import pytest

from studies.catalog.demo import WORDS
from studies.cli.commands import demo
from studies.metrics.timing import protocol
from studies.sweep.job import case_jobs
from tests.studies.tiny import tiny_study


@pytest.mark.campaign
def test_three_bodies_have_speeds_with_a_spread(organbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = organbench("demo", "--results", "results/demo")
    assert code == 0
    for words in WORDS:
        assert re.search(
            rf"^{words}: volume .+, force .+ ± .+ %, .+ times real time \(.+ by processor time\)$", out, re.MULTILINE
        )
    page = Path("results/demo/report.html").read_text(encoding="utf-8")
    assert "<code>organbench run demo --results results/demo</code>" in page
    assert "simulated in a second of computing" in page and "o time is measured" not in page
    # The curve of the recommended body too.
    assert "quadratic, masses by stiffness" in page


def test_other_programs_on_the_core_are_a_warning(results, monkeypatch, capsys):
    monkeypatch.setattr(protocol, "processor_seconds", iter(np.array([[0, 0, 0], [9, 9, 2]])).__next__)
    demo.time_frames(case_jobs(results, tiny_study())[0])
    assert "other processes took 78 % of the processors" in capsys.readouterr().err
