"""Bounds are read in the usual spellings; anything else is refused in one sentence."""

import pytest

from studies.base.errors import StudyError
from studies.cli.options import budget, share


@pytest.mark.parametrize("text", ["3%", "3 %", " 3% ", "0.03", ".03", "3e-2", "3.0%"])
def test_a_share_is_a_number_or_per_cent(text):
    assert share(text, "force") == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("text", "cost"),
    [("1ms", 1.0), ("250us", 0.25), ("250 µs", 0.25), ("250μs", 0.25), ("0.5 ms", 0.5), ("2e-3s", 2.0)],
)
def test_a_budget_is_computing_time_for_a_simulated_millisecond(text, cost):
    assert budget(text) == pytest.approx(cost)


def test_no_text_is_no_bound():
    assert share("", "force") is None and budget("") is None


@pytest.mark.parametrize("text", ["3", "0", "0%", "-3%", "101%", "three", "%", "3%%", "3,0%", "nan", "inf", "1 2"])
def test_what_is_no_share_is_refused(text):
    with pytest.raises(StudyError, match="is not a tolerance; give a share above 0 and up to 100 %"):
        share(text, "force")


@pytest.mark.parametrize("text", ["1", "0ms", "-1ms", "1 min", "ms", "1mss", "nan ms", "1e999s"])
def test_what_is_no_time_is_refused(text):
    with pytest.raises(StudyError, match="is not a time; give the computing time per 1 ms of simulated time"):
        budget(text)
