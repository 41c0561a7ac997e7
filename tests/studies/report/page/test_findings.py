"""Findings are what the tables say, number by number; without tables there are none."""

import pytest

from studies.report.page.findings import findings

BODY = {"scene": "ball", "law": "van_gelder", "nodes": 550, "stiffness": 1.0}
COMMON = BODY | {"dt [ms]": 1.0, "dt/dt_c": 0.5, "status": "ok"}


def row(body="tetrahedral", method="implicit_volume", **values):
    return COMMON | {"body": body, "method": method} | values


def loss(body, method, volume, force, mean=4.0, **values):
    errors = {"volume_worst [%]": volume, "force_end [%]": force, "force_end floor [%]": 0.2, "mean_error [%]": mean}
    return row(body, method, **errors, **{"mean_error floor [%]": 0.3}, **values)


TABLES = {
    "volume_loss": [
        loss("tetrahedral", "free", 8.3, -50.8),
        loss("tetrahedral", "implicit_volume", 3.1e-6, -35.3),
        loss("surface", "free", 18.0, -98.9),
        loss("surface", "implicit_volume", 8.7e-6, -83.8),
        loss("surface", "implicit_volume", 99.0, 1.0, status="diverged"),
        loss("quadratic", "implicit_volume", 2e-7, 1.1, mean=0.8, scene="liver"),
    ],
    "frame_rate": [
        row(method=method, **{"frame_time [ms]": ms, "frame_time floor [ms]": 0.01, "real_time [s/s]": fast})
        for method, ms, fast in (("free", 0.2, 30.0), ("implicit_volume", 0.25, 0.9))
    ],
    "stability_map": [
        row(status=status, **{"dt/dt_c": dt}) for status, dt in (("ok", 0.9), ("diverged", 0.8), ("diverged", 1.2))
    ],
}


@pytest.fixture(scope="module")
def by_title():
    return {finding.title: finding for finding in findings(TABLES)}


def test_volumes(by_title):
    finding = by_title["How well volumes are kept"]
    assert finding.number == "8.7 × 10⁻⁶ %" and "2 pairs" in finding.text
    assert "up to 18 % (ball, surface, 550 nodes)" in finding.text


def test_forces_and_their_uncertainty(by_title):
    one = by_title["Forces of bodies with one volume"]
    assert one.number == "−83.8 ± 0.2 %" and "−35.3 ± 0.2 % in tetrahedral bodies" in one.text
    best = by_title["The force nearest to the reference"]
    assert best.number == "+1.1 ± 0.2 to −35.3 ± 0.2 %"
    assert "+1.1 ± 0.2 % in liver (quadratic, 550 nodes; mean displacement error 0.8 ± 0.3 %)" in best.text


def test_times_and_their_spread(by_title):
    cost = by_title["Cost of keeping a volume"]
    assert cost.number == "+25 ± 11 %" and "in 1 pair of runs" in cost.text and "In 0 pairs" in cost.text
    assert "0.25 ± 0.01 ms against 0.20 ± 0.01 ms" in cost.text
    assert by_title["Speed"].number == "1 of 2" and "0.9 s" in by_title["Speed"].text


def test_counts_of_the_map(by_title):
    limit = by_title["The limit of the time step"]
    assert limit.number == "1 of 2" and "above it 0 of 1 do not" in limit.text


def test_no_tables_no_findings():
    assert findings({}) == [] and findings({"volume_loss": [], "frame_rate": [], "stability_map": []}) == []
    empty = {name: [row(**dict.fromkeys(one.keys() - row().keys())) for one in table] for name, table in TABLES.items()}
    del empty["stability_map"]
    assert findings(empty) == [] and findings({"frame_rate": [row(), row(method="free")]}) == []


def with_entries(*entries):
    """The same tables with rows of entries from outside in that of volumes."""
    return {**TABLES, "volume_loss": [*TABLES["volume_loss"], *({**row, "entry": True} for row in entries)]}


def test_an_entry_is_named_where_it_is_the_best_of_its_scene_and_only_there():
    best = loss("tetrahedral", "theirs", 5.0, -0.9, mean=5.0)
    (finding,) = [one for one in findings(with_entries(best)) if one.title == "Results of other programs"]
    assert finding.number == "1 of 3"  # force; neither mean displacement nor volume
    sentence = "force of theirs in ball, −0.9 ± 0.2 % (ours at best −35.3 ± 0.2 %, ball, tetrahedral, 550 nodes by "
    assert sentence + "implicit_volume)." in finding.text and finding.text.count(" of theirs in ") == 1
    worse = loss("tetrahedral", "theirs", 5.0, -36.0, mean=5.0)
    (finding,) = [one for one in findings(with_entries(worse)) if one.title == "Results of other programs"]
    assert finding.number == "0 of 3" and finding.text.endswith("and methods.")
    alone = loss("tetrahedral", "theirs", 5.0, -36.0, scene="spleen")
    assert "force of theirs in spleen, −36.0 ± 0.2 %;" in findings(with_entries(alone))[-1].text


def test_an_entry_changes_no_finding_on_ours():
    quick = {"real_time [s/s]": 1e-3, "frame_time [ms]": 9.0}
    strange = loss("tetrahedral", "theirs", 99.0, 500.0, **quick)
    assert findings(with_entries(strange))[:-1] == findings(TABLES)
    limits = {**TABLES, "stability_map": [*TABLES["stability_map"], row(status="diverged", entry=True)]}
    assert findings(limits) == findings(TABLES)


CHANGES = {
    "volume_loss": lambda one: {name: 1.5 * value if "%" in name else value for name, value in one.items()},
    "frame_rate": lambda one: {name: value**2 if "_time " in name else value for name, value in one.items()},
    "stability_map": lambda one: one | {"status": "diverged"},
}


@pytest.mark.parametrize("name", TABLES)
def test_a_number_that_moves_moves_its_finding(name):
    """No number is written into the text."""
    before, after = findings(TABLES), findings({**TABLES, name: [CHANGES[name](one) for one in TABLES[name]]})
    assert [one.title for one in before] == [one.title for one in after] and before != after
