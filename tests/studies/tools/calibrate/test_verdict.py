"""The verdict on fits that fail outside their own scenes, on made-up numbers."""

import pytest

from studies.tools.calibrate.verdict import Compared, Verdict, verdict_of, worst

HOLDS, MEMORISES, UNRESOLVED = Verdict


@pytest.mark.parametrize(
    ("fitted", "judged", "verdict"),
    [
        ((-30.0, 0.0), (-33.0, -10.0), HOLDS),  # 70 % of what the fit gains
        ((-30.0, 0.0), (20.0, 2.0), HOLDS),  # whatever the sign
        ((-30.0, 0.0), (-33.0, -25.0), MEMORISES),  # a quarter of it
        ((-30.0, 0.0), (-30.0, 38.0), MEMORISES),  # too far, to the other side
        ((-30.0, 0.0), (-3.0, 12.0), MEMORISES),  # spoils what was right
        ((-30.0, 0.0), (-33.0, -16.0), UNRESOLVED),  # half of it, to a percent
        ((-30.0, -15.0), (-40.0, -28.0), HOLDS),  # 30 % where 25 % are due
        ((-30.0, -15.0), (-40.0, -34.0), MEMORISES),  # 15 % where 25 % are due
        ((-30.0, 0.0), (0.4, 0.3), UNRESOLVED),  # nothing there to gain
        ((5.0, 4.5), (6.0, 5.4), UNRESOLVED),  # changes by less than the uncertainty
        ((5.0, 4.5), (6.0, 9.0), MEMORISES),  # and does harm
        ((5.0, 8.0), (6.0, 8.8), UNRESOLVED),  # given up for another quantity, as much in both
        ((5.0, 8.0), (6.0, 12.0), MEMORISES),  # and more in the other
        ((5.0, 4.5), (9.0, 2.0), UNRESOLVED),  # what the fit did not look for is luck
        ((-30.0, 0.0), (-33.0, None), MEMORISES),  # the fitted body does not come through
    ],
)
def test_verdict_of_one_scene_each(fitted, judged, verdict):
    assert verdict_of([Compared(*fitted, 1.0)], [Compared(*judged, 1.0)]) is verdict


def test_no_reference_is_better_than_its_uncertainty():
    """The same numbers with smaller and larger uncertainties."""
    pairs = (-30.0, 0.0), (-33.0, -10.0)
    for uncertainty, verdict in ((1.0, HOLDS), (7.0, UNRESOLVED), (40.0, UNRESOLVED)):
        assert verdict_of([Compared(*pairs[0], 1.0)], [Compared(*pairs[1], uncertainty)]) is verdict
    assert verdict_of([Compared(*pairs[0], 40.0)], [Compared(*pairs[1], 1.0)]) is UNRESOLVED


def test_several_scenes_count_by_their_mean_square():
    fitted = [Compared(-30.0, 0.0, 1.0)]
    good, bad = Compared(-40.0, 0.0, 1.0), Compared(-10.0, 10.0, 1.0)
    assert verdict_of(fitted, [bad]) is MEMORISES
    assert verdict_of(fitted, [good, bad]) is HOLDS  # 29.2 -> 7.1
    assert verdict_of(fitted, [Compared(-12.0, 0.0, 1.0), bad, bad]) is MEMORISES  # 10.7 -> 8.2


def test_without_a_comparison_there_is_no_verdict():
    pair = Compared(-30.0, 0.0, 1.0)
    assert verdict_of([], [pair]) is None and verdict_of([pair], []) is None


def test_one_quantity_that_memorises_spoils_all():
    assert worst([HOLDS, MEMORISES, UNRESOLVED, None]) is MEMORISES
    assert worst([HOLDS, UNRESOLVED, None]) is HOLDS
    assert worst([UNRESOLVED, None]) is UNRESOLVED
    assert worst([None]) is UNRESOLVED
