"""Writes charts, tables as CSV, and the summary of results in README."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from studies.base.atomic import write_whole
from studies.base.doing import doing
from studies.base.errors import StudyError
from studies.catalog import STUDIES
from studies.catalog.study import Study
from studies.exchange.entry import FOLDER as SUBMISSIONS
from studies.exchange.entry import entries_beside
from studies.exchange.league import LEAGUE
from studies.geometry import SHAPES, organ
from studies.metrics.interval import RULE_FILE
from studies.metrics.run import Run
from studies.metrics.table import metric, study_table
from studies.report.league import NAME as LEAGUE_NAME
from studies.report.league import write_league
from studies.report.page.entries import ENTRIES, refresh_entries
from studies.report.page.part import read_part, run_id, write_part
from studies.report.page.write import NAME, write_page
from studies.report.references import refresh_uncertainty, state_of
from studies.report.summary import SUMMARIES
from studies.runs.paper import play, slide_case, squeezed_balls
from studies.runs.user_code import fault_of, file_of
from studies.scene.scene import Scene
from studies.store.archived import is_archive, shown_machine
from studies.store.ledger import Ledger
from studies.store.machine import write_machine
from studies.store.paths import study_folder
from studies.store.tables import write_table
from studies.sweep.job import case_jobs, reference_jobs
from studies.sweep.load import References, load_runs

FIGURES = "figures"
FIGURE_NODES = 550
PAPER_NODES = {"liver": 544, "stomach": 550}
"""Surface nodes of the organs in Figure 1 of Jung, Hong and Choi (2005)."""


def draw_charts(root: Path, study: Study, runs: Sequence[Run]) -> list[Path]:
    """Draws all charts of a study; their paths. Raises StudyError for those that a study file draws and cannot, after
    the others were drawn."""
    folder = study_folder(root, study.name)
    make_folder(folder)
    failures = []
    for chart in study.charts:
        try:
            chart.draw(runs, folder / chart.file)
        except Exception as error:  # a user's chart may raise any exception
            own = fault_of(error)
            if own is None and file_of(chart.draw) is not None:  # it could not even be called
                own = f"its function fails: {type(error).__name__}: {error}"
            if own is None:
                raise
            failures.append(f"chart {chart.file} is not drawn, {own}")
    if failures:
        raise StudyError("; ".join(failures))
    return [folder / chart.file for chart in study.charts]


def make_folder(folder: Path) -> None:
    """The folder, when it is not there yet. Raises StudyError when it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(
            f"{folder} cannot be made ({error.strerror}); choose a folder that can be written to"
        ) from error


def report(
    ledger: Ledger, studies: Sequence[Study], drawn: Sequence[Study] | None = None
) -> tuple[list[Path], list[str]]:
    """Charts and tables of all studies, the summaries, machine.json, the league where somebody entered it, and
    report.html, which shows all of it in one page; paths, and what is missing in sentences. drawn: draw these alone,
    and show the others as they were drawn last.
    """
    if drawn is None:
        written, remarks = charts_and_tables(ledger, studies)
    else:
        refreshed = [refresh(ledger, study) for study in drawn]
        written = [path for paths, _ in refreshed for path in paths]
        remarks = [sentence for _, sentences in refreshed for sentence in sentences]
    pages, left_out = _pages(ledger, studies)
    return [*written, *pages], [*remarks, *left_out]


def report_entry(ledger: Ledger, run: Run, scene: Scene) -> tuple[Path, list[str]]:
    """The page that shows an entry of another program, with all that was drawn last; and what is missing, in sentences.
    scene: as it was found, with the plan of its reference."""
    paths, remarks = _pages(ledger, STUDIES, [scene], run_id(run))
    league = LEAGUE in run.record.attributes
    return next(path for path in paths if path.name == (LEAGUE_NAME if league else NAME)), remarks


def _pages(
    ledger: Ledger, studies: Sequence[Study], scenes: Sequence[Scene] = (), shown: str | None = None
) -> tuple[list[Path], list[str]]:
    """Those of the league and of the entries, and report.html; none of what nothing is stored."""
    league, cards, unread = write_league(ledger.root)
    own = [scene for study in studies if study not in STUDIES for scene in study.scenes]
    unreadable = refresh_entries(ledger, [*own, *scenes])
    page, left_out = write_page(ledger.root, [*studies, ENTRIES], cards, shown)
    return [*league, *([page] if page else [])], [*unread, *unreadable, *left_out]


def charts_and_tables(ledger: Ledger, studies: Sequence[Study]) -> tuple[list[Path], list[str]]:
    """The same without the page.

    A study of which nothing is stored keeps the charts that are there.
    """
    written, remarks, absent, root = [], [], [], ledger.root
    references = References(ledger)
    for study in studies:
        if not any(map(ledger.entry, case_jobs(root, study))):
            absent.append(study.name)
            continue
        paths, missing = refresh(ledger, study, references)
        written += paths
        remarks += [f"{study.name}: {sentence}" for sentence in missing]
    # Not of studies that were never run here: the published references of all scenes take a minute to read and measure.
    present = [study for study in studies if study.name not in absent]
    written += refresh_uncertainty(references, [scene for study in present for scene in study.scenes])
    if present and not is_archive(root):
        write_machine(root / "machine.json")
    if absent:
        remarks.append(
            f"skipped (no results here; existing charts kept): {', '.join(absent)}. Run `make study-NAME` first"
        )
    return written, remarks


def refresh(ledger: Ledger, study: Study, references: References | None = None) -> tuple[list[Path], list[str]]:
    """Draws the charts and writes the tables of a study, unless they show what is stored already; their paths, and what
    is missing in sentences.

    references: those of the ledger, where other studies need them too.
    """
    return StudyDrawing(ledger, study, references or References(ledger)).refreshed()


@dataclass(frozen=True)
class StudyDrawing:
    """All that is drawn and written of a study, from what is stored of it."""

    ledger: Ledger
    study: Study
    references: References

    @cached_property
    def folder(self) -> Path:
        return study_folder(self.ledger.root, self.study.name)

    @cached_property
    def stamp(self) -> Path:
        return self.ledger.root / "cache" / f"{self.study.name}.drawn.json"

    @property
    def paths(self) -> list[Path]:
        charts = [*(self.folder / chart.file for chart in self.study.charts), self.folder / f"{self.study.name}.csv"]
        return charts + [self.ledger.root / file for file in SUMMARIES.get(self.study.name, ())]

    @cached_property
    def state(self) -> str:
        """Hash of all that charts and tables are made from: the lines of the ledger, and the code, that of the user's
        files too."""
        ledger, study = self.ledger, self.study
        jobs, machine = case_jobs(ledger.root, study), shown_machine(ledger.root)
        others = [*(ledger.timing(job, machine) for job in jobs), *ledger.files(SUBMISSIONS).values()]
        metrics = [metric(column) for column in study.columns]
        drawings = [entry.of for entry in metrics] + [chart.drawing for chart in study.charts]
        own = {file.sha256 for file in map(file_of, drawings) if file is not None}
        names = [*(job.digest for job in jobs), *(entry.name for entry in metrics), *sorted(own), study.word]
        names.append(RULE_FILE.read_text(encoding="utf-8"))
        files = ledger.state([*jobs, *reference_jobs(ledger.root, study.scenes)])
        return state_of(files, *(entry.written if entry else "-" for entry in others), *names)

    def refreshed(self) -> tuple[list[Path], list[str]]:
        before = _stamped(self.stamp)
        current = before.get("inputs") == self.state and all(path.exists() for path in self.paths)
        if current and read_part(self.ledger.root, self.study) is not None:
            return self.paths, before["remarks"]
        return self.paths, self.drawn()

    def drawn(self) -> list[str]:
        """Writes tables, summaries, charts and the part of the page; what is missing, in sentences."""
        from studies.plots.style.style import svg_copies  # with matplotlib, which takes half a second to load

        root, study = self.ledger.root, self.study
        doing(study.name)
        own, remarks = load_runs(root, study, self.references)
        submissions, unreadable = entries_beside(root, study.scenes, self.references.of)
        runs, remarks = [*own, *submissions], [*remarks, *unreadable]
        rows = study_table(runs, study.columns)
        write_table(self.folder / f"{study.name}.csv", rows)
        for file, text in SUMMARIES.get(study.name, {}).items():
            write_whole(root / file, (text(own) + "\n").encode())
        with svg_copies() as pictures:
            draw_charts(root, study, runs)
        write_part(root, study, runs, rows, pictures)
        write_whole(self.stamp, json.dumps({"inputs": self.state, "remarks": remarks}).encode())
        return remarks


def _stamped(stamp: Path) -> dict[str, Any]:
    """The state that was drawn last; empty if it is missing or cannot be read, so that everything is drawn again."""
    try:
        before = json.loads(stamp.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    valid = isinstance(before, dict) and isinstance(before.get("inputs"), str)
    return before if valid and isinstance(before.get("remarks"), list) else {}


def draw_figures(root: Path) -> list[Path]:
    """The gallery of all organs, and Figures 1 to 4 of Jung, Hong and Choi (2005) from our runs; their paths."""
    from studies.plots.figures.organ_springs import draw_organ_springs  # with matplotlib, as above
    from studies.plots.figures.organs import draw_organs

    gallery, springs = root / FIGURES / "organs.png", root / FIGURES / "organ_springs.png"
    make_folder(gallery.parent)
    draw_organs({name: organ(name, FIGURE_NODES) for name in SHAPES}, gallery)
    draw_organ_springs({name: organ(name, nodes, fill=False) for name, nodes in PAPER_NODES.items()}, springs)
    paper = draw_paper(gallery.parent)
    return [gallery, springs, *paper]


def draw_paper(folder: Path) -> list[Path]:
    """The paper's Figures 2 to 4, run now: two balls in seconds, the refined stomach in about a minute."""
    from studies.plots.figures import paper_ball, paper_slide  # with matplotlib, as above

    squeezed, volume, slide = (folder / f"paper_{name}.png" for name in ("squeezed", "volume", "slide"))
    paper_ball.draw(squeezed_balls(), squeezed, volume)
    paper_slide.draw(play(slide_case()), slide)
    return [squeezed, volume, slide]
