"""The first lines of the page: which body, how wrong, how fast, and the paper's body, from made-up runs."""

from dataclasses import replace

import pytest

from massspring import Free
from studies.meshing.true_surface import ShapeErrors
from studies.metrics.table import OFF_SHAPE
from studies.report.page.best import answers, best_bodies, joined_best, own_first, scene_rows
from studies.scene.library import BALL_CLAMPED, LIVER_PRESS
from tests.studies.plots.made_up import run


def named(made):
    return f"{made.case.body.kind}-{made.case.body.nodes}-{made.case.method.name}"


def shaped(made, distance, volume=-0.001):
    """The run with errors of its shape [1] that are not those of the made-up body."""
    made.__dict__["shape"] = ShapeErrors(distance, volume)
    return made


def good(scene=LIVER_PRESS, distance=0.003, **options):
    return shaped(run(scene, **{"error": 0.004, "nodes": 300, "frame_ms": 10.0} | options), distance)


def paper(scene=LIVER_PRESS, **options):
    return shaped(run(scene, "surface", nodes=550, error=0.5, **options), 0.08)


def test_a_body_beyond_the_bounds_of_the_shape_is_not_the_best():
    (best,) = best_bodies([good(distance=0.011, frame_ms=1.0), good(nodes=400)], named)
    assert best["meets"] and best["case"] == "tetrahedral-400-implicit_volume"
    (best,) = best_bodies([good(distance=0.011), paper()], named)
    assert not best["meets"] and best["case"] == "tetrahedral-300-implicit_volume"


def test_what_is_missing_from_the_shape_stands_first():
    first, answer = next(iter(answers(best_bodies([good(distance=0.0197)], named)).items()))
    assert first == "What is missing?" and "up to 2 % of the size off its organ" in answer
    assert "about 600 nodes would do" in answer  # 1.97 times 300
    assert next(iter(answers(best_bodies([good()], named)))) == "Which body?"


def test_a_reference_off_the_shape_is_missing_too():
    rows = [{"case": "", "scene": "liver_press", OFF_SHAPE: off} for off in (0.4, 2.5)]
    for shown, words in ((rows[:1], "Which body?"), (rows, "What is missing?")):
        given = answers(joined_best([best_bodies([good()], named)], shown))
        assert next(iter(given)) == words
    assert "the reference of liver press is up to 2.5 % of the size off" in given["What is missing?"].lower()


def test_the_cheapest_body_within_the_target_stands_beside_the_papers_with_its_numbers():
    runs = [paper(frame_ms=5.0), good(frame_ms=40.0, nodes=400), good(), good(method=Free(), nodes=9)]
    (best,) = best_bodies(runs, named)
    assert best["meets"] and best["case"] == "tetrahedral-300-implicit_volume"
    assert best["paper"]["case"] == "surface-550-implicit_volume" and best["paper"]["force"] == pytest.approx([-50, 2])
    assert best["force"] == pytest.approx([-0.4, 2]) and best["shape"] == pytest.approx([0.3, 0])
    # A frame is 0.2 s long and takes 10.2 ms, the median of five repeats that grow by a hundredth each.
    assert best["speed"] == pytest.approx([0.2 / 0.0102, 0.4], abs=0.02)
    wrong, fast = answers([best])["How wrong?"], answers([best])["How fast?"]
    assert "−0 ± 2 %" in wrong and "−50 ± 2 %" in wrong and "19.6 ± 0.4 s" in fast


def test_scenes_of_ones_own_are_answered_for_and_come_first():
    best = best_bodies([good(), good(BALL_CLAMPED, error=0.2)], named)
    own = {best[1]["scene"]}
    assert answers(best, own) == answers([best[1]]) != answers(best)
    assert [row["scene"] for row in own_first(best, own)] == [best[1]["scene"], best[0]["scene"]]
    assert answers(best, {"a scene in which no body is judged"}) == answers(best)
    assert "1 of 2 scenes" in answers(best)["Which body?"] and "0.4 to 20 %" in answers(best)["How wrong?"]


def test_of_several_studies_the_best_body_counts_and_a_time_of_either():
    slow, quick = (best_bodies([good(frame_ms=ms, nodes=nodes)], named) for ms, nodes in ((40.0, 300), (10.0, 400)))
    missed = best_bodies([good(error=0.2, frame_ms=1.0), paper()], named)
    (row,) = joined_best([slow, missed, quick], [])
    assert row["case"] == "tetrahedral-400-implicit_volume" and row["paper"]["speed"] is None
    rows = [{"case": "surface-550-implicit_volume", "scene": "", "real_time [s/s]": 7.0, "real_time floor [s/s]": 0.5}]
    assert joined_best([slow, missed, quick], rows)[0]["paper"]["speed"] == [7.0, 0.5]


def test_a_body_without_an_error_is_not_named():
    diverged = replace(good(), record=replace(good().record, status="diverged"))
    for made in (good(with_reference=False), good(method=Free()), diverged):
        assert best_bodies([made], named) == []
    assert answers([]) == {}


@pytest.mark.parametrize(("cpu", "mark"), [(0.98, ""), (0.5, " ¶")])
def test_speeds_are_of_wall_and_of_processor_time_of_a_named_processor(cpu, mark):
    best = best_bodies([good(cpu=cpu)], named)
    speed, own = scene_rows(best)[0]["rows"][0]["numbers"][-2:]
    assert float(own.split()[0]) == pytest.approx(0.2 / (0.0102 * cpu), rel=0.02)
    assert speed.endswith(mark) and (" ± " in speed) == (" ± " in own) == (not mark)
    assert f"on one core of Z80{mark}." in answers(best)["How fast?"]
