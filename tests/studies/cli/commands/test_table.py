"""The table on the terminal: as wide as it is, values with their uncertainty, shared settings in one line."""

import pytest

from massspring import ImplicitVolume, Xpbd
from studies.cli.commands import table
from studies.metrics.cells import (
    DISTURBED_MARK,
    DISTURBED_NOTE,
    FEW_MARK,
    FEW_NOTE,
    MISSED_NOTE,
    UNCONVERGED_NOTE,
    value_cell,
)
from studies.metrics.metrics import METRICS
from studies.metrics.table import DISTURBED, FEW_FACETS, MISSES, PROCESSOR, UNRESOLVED, row_of
from studies.report.page.markup import table as page_table
from studies.report.summary import results_of
from studies.scene.library import BALL_CLAMPED, LIVER_PRESS, STOMACH_PRESS
from tests.studies.plots.made_up import run

CHOSEN = [metric for metric in METRICS if metric.name in ("volume_worst", "force_end", "mean_error", "min_j")]


@pytest.mark.parametrize(
    ("value", "uncertainty", "options", "text"),
    [
        (-50.84, 0.228, {"signed": True}, "−50.8 ± 0.2"),
        (9.441, 0.4731, {}, "9.4 ± 0.5"),
        (19.6, 1.01, {"unresolved": True, "missed": True}, "20 ± 1 † *"),
        (0.37164, float("nan"), {}, "0.372"),
        (1.37164, float("nan"), {"missed": True}, "1.37 *"),
        (3.1e-6, 0.0, {}, "3.1e−06"),
        (float("nan"), 0.1, {}, "–"),
        (12345.6, float("nan"), {}, "12,346"),
    ],
)
def test_a_value_has_the_digits_of_its_uncertainty(value, uncertainty, options, text):
    assert value_cell(value, uncertainty, **options) == text


def row(scene="ball", method="free", **changes):
    settings = {"law": "van_gelder", "nodes": 550, "stiffness": 1.0, "dt/dt_c": 0.5, "status": "ok"} | {
        UNRESOLVED: "",
        MISSES: "",
    }
    numbers = {f"{m.name} [{m.unit}]": 12.0 for m in CHOSEN} | {"force_end floor [%]": 0.2}
    return {"scene": scene, "body": "surface", "method": method, **settings, **numbers, **changes}


def test_what_all_share_is_printed_once_and_what_differs_is_a_column(organbench, capsys):
    table.draw([row(), row(method="implicit_volume", nodes=150)], CHOSEN, False)
    first, *rest = capsys.readouterr().out.splitlines()
    assert first == "law van_gelder, stiffness 1, dt = 0.5 dt_c"
    assert rest[-2].split()[:2] == ["free", "550"]
    assert rest[-1].split()[:2] == ["implicit_volume", "150"]
    assert "+12.0 ± 0.2" in rest[-1]


def test_a_setting_of_a_group_stands_in_its_heading(capsys):
    table.draw([row(), row("liver", nodes=150)], CHOSEN, False)
    out = capsys.readouterr().out.splitlines()
    assert "ball, surface, 550 nodes" in out and "liver, surface, 150 nodes" in out


@pytest.mark.parametrize("width", [40, 60, 80, 100])
def test_lines_fit_and_say_what_is_left_out(monkeypatch, capsys, width):
    monkeypatch.setattr(table.console, "_width", width)
    rows = [row(method=name) for name in ("free", "post_stabilization")]
    metrics = [*CHOSEN, *(m for m in METRICS if m.name == "silhouette_error")] * 2
    rows = [{**r, "silhouette_error [%]": 1.0} for r in rows]
    table.draw(rows, metrics, False)
    out = capsys.readouterr().out.splitlines()
    drawn = [line for line in out if not line.startswith(("not shown", "law"))]
    assert max(map(len, drawn)) <= width
    shown = sum("%" in word or "1" in word for word in next(line for line in out if "[%]" in line).split())
    (left_out,) = (line for line in out if line.startswith("not shown"))
    assert shown + len(left_out.split(": ")[1].split(", ")) == len(metrics)
    table.draw(rows, metrics, True)
    out = capsys.readouterr().out.splitlines()
    assert sum(line.strip().startswith("free") for line in out) > 1
    assert not any(line.startswith("not shown") for line in out)


def test_the_status_is_a_column_where_a_run_did_not_end_well(capsys):
    table.draw([row(), row(method="penalty", status="diverged")], CHOSEN, False)
    out = capsys.readouterr().out.splitlines()
    assert out[-1].split()[:2] == ["penalty", "diverged"] and out[-2].split()[:2] == ["free", "ok"]


def test_a_row_with_few_facets_is_marked(capsys):
    table.draw([row(**{FEW_FACETS: True}), row(method="implicit_volume", **{FEW_FACETS: False})], CHOSEN, False)
    out = capsys.readouterr().out
    assert [line.split()[1] == FEW_MARK for line in out.splitlines() if line.startswith(("  free", "  implicit"))] == [
        True,
        False,
    ]
    assert FEW_NOTE in out
    table.draw([row()], CHOSEN, False)
    assert FEW_MARK not in capsys.readouterr().out


def test_a_time_names_its_processor_and_is_marked_where_it_was_disturbed(capsys):
    table.draw([row(**{DISTURBED: "it waited", PROCESSOR: "Z80"}), row(**{PROCESSOR: "Z80"})], CHOSEN, False)
    out = capsys.readouterr().out
    assert out.count(DISTURBED_MARK) == 2 and DISTURBED_NOTE in out and "processor: Z80\n" in out


def test_a_method_that_does_not_converge_is_marked_in_every_table(capsys):
    """By what the method says of itself; with a line that says what the mark means."""
    ours, theirs = (run(BALL_CLAMPED, method=method, error=3.0) for method in (ImplicitVolume(), Xpbd()))
    rows = [row_of(one, CHOSEN) for one in (ours, theirs)]
    table.draw(rows, CHOSEN, False)
    printed = capsys.readouterr().out
    summary = results_of([ours, theirs])
    for text in (printed, summary):
        assert "xpbd §" in text and UNCONVERGED_NOTE in text and "implicit_volume §" not in text
    table.draw(rows[:1], CHOSEN, False)
    assert "§" not in capsys.readouterr().out and "§" not in results_of([ours])
    shown = page_table([{**one, "case": "0", "study": "tiny"} for one in rows], {})["rows"]
    assert [one["lines"][1] for one in shown] == ["implicit_volume", "xpbd §"]


def test_what_misses_its_target_is_marked_in_the_table_and_on_the_page(capsys):
    """Of a solid organ 3 and 1 %, of a hollow one 6 and 3 %."""
    runs = [run(scene, error=0.035, nodes=300) for scene in (LIVER_PRESS, STOMACH_PRESS)]
    rows = [row_of(one, CHOSEN) for one in runs]
    assert [row["force_end [%]"] for row in rows] == pytest.approx([-3.5, -3.5])
    for shown, marked in ((rows[:1], True), (rows[1:], False)):
        table.draw(shown, CHOSEN, False)
        printed = capsys.readouterr().out
        page = page_table([{**shown[0], "case": "0", "study": "tiny"}], {})
        force = dict(zip([head[0] for head in page["heads"][1:]], page["rows"][0]["cells"], strict=True))["force [%]"][
            2
        ]
        assert force.endswith(" *") == marked == (force in printed and MISSED_NOTE in printed)
