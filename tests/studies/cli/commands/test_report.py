"""`organbench report`: what is drawn, and what a chart of the user breaks."""

import pytest

OWN = "from studies.catalog import Chart\nfrom tests.studies.tiny import *\n"
CHARTS = {
    "lambda r, p: 1/0": "chart a.png is not drawn, mine.py fails: ZeroDivisionError in line 3: division by zero",
    "lambda r: 1": "chart a.png is not drawn, its function fails: TypeError",
}


@pytest.mark.parametrize("draw", CHARTS)
def test_a_chart_that_fails_is_a_sentence_after_all_else_is_done(refused, results, tmp_path, draw):
    path = tmp_path / "mine.py"
    other = "Chart('b.txt', lambda r, p: p.write_text('drawn'))"
    path.write_text(OWN + f"STUDY = tiny_study(charts=(Chart('a.png', {draw}), {other}))\n")
    assert CHARTS[draw] in refused("report", path, "--results", results)
    assert (results / "tiny" / "b.txt").read_text() == "drawn"
    assert (results / "tiny" / "tiny.csv").exists()
