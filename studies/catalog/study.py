"""A study: a question, the cases that answer it, the charts that show the answer."""

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, cast

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.runs.case import Case
from studies.runs.recipes import TetrahedralBody
from studies.scene.scene import Scene
from studies.store.paths import readable
from studies.store.schema import Status

if TYPE_CHECKING:
    from studies.metrics.metric import Metric
    from studies.metrics.run import Run

Drawing = Callable[[Sequence["Run"], Path], None]
"""Draws runs into a file."""

SMOKE_NODES, SMOKE_NODES_CUT, SMOKE_NODES_HOLLOW = 150, 250, 400
"""Of a solid organ, of one that is cut (with 150 the tip by which liver_incised is pulled has a quarter too little
area), and of a hollow one, whose wall folds on a coarser surface."""
SMOKE_QUADRATIC = (594, 594, 850)
"""The same with mid-side nodes, of 150 and 214 vertices: fewer hold no node of a small region."""
RESERVED = (
    "cache",
    "calibration",
    "entries",
    "figures",
    "league",
    "main",
    "reference",
    "report-cases",
    "smoke",
    "verify",
)
"""Folders of the results that are no study's ("calibration" in folders of release 0.3), and the word for the main
studies."""
SMOKE_FRAMES = 20


@dataclass(frozen=True)
class Chart:
    """A picture of a study's runs."""

    file: str
    drawing: Drawing | str
    """A function, or where one is, as "package.module:function": its module is loaded when the chart is drawn."""

    @property
    def draw(self) -> Drawing:
        """The function. Raises StudyError where there is none."""
        if callable(self.drawing):
            return self.drawing
        module, _, function = self.drawing.partition(":")
        try:
            drawing = getattr(import_module(module), function)
        except Exception as error:  # a module of a user may fail in any way
            raise StudyError(
                f"chart {self.file}: there is no function {self.drawing!r} ({type(error).__name__}: {error}); "
                "give 'package.module:function'"
            ) from error
        if callable(drawing):
            return cast("Drawing", drawing)
        raise StudyError(f"chart {self.file}: {self.drawing!r} is not a function; give one of the runs and a path")

    def __post_init__(self) -> None:
        if readable(self.file) != self.file:
            raise StudyError(
                f"a chart cannot be called {self.file!r}; use letters, digits, '.', '_' and '-', no folder"
            )
        if not callable(self.drawing) and ":" not in str(self.drawing):
            raise StudyError(
                f"chart '{self.file}' is drawn by {self.drawing!r}; give a function of the runs and a path, "
                "or 'package.module:function'"
            )


@dataclass(frozen=True)
class Study:
    """A question over many cases."""

    name: str
    question: str
    cases: tuple[Case, ...]
    charts: tuple[Chart, ...]
    columns: "tuple[str | Metric, ...]"
    """Metrics shown in its table: names of METRICS, or metrics of one's own."""
    main: bool = False
    """Whether it belongs to `make study`, and to `organbench run` without a name."""
    counts_losses: bool = False
    """Whether cases and references that fail are part of its answer: it is published with them."""
    scene_by_scene: bool = False
    """Whether its scenes run one after the other, each with its reference and all its cases, so that a study cut short
    has whole scenes; otherwise the longest jobs of all scenes come first."""
    word: str = field(default="", compare=False)
    """What the command line calls it where that is not its name: FILE.py, or NAME@FOLDER."""
    expects: tuple[str, ...] = ()
    """How its cases may end besides ok and skipped: with any other status, `organbench run` ends with exit code 1."""

    def __post_init__(self) -> None:
        for what in ("name", "question"):
            if not isinstance(getattr(self, what), str):
                raise StudyError(f"the {what} of a study is {getattr(self, what)!r}; give a text")
        if self.name in RESERVED:
            raise StudyError(f"a study cannot be called '{self.name}': that word has another meaning for the program")
        for what, kind in (("cases", Case), ("charts", Chart), ("columns", str), ("expects", str)):
            given = getattr(self, what)
            if not isinstance(given, tuple | list):
                words = repr(given) if kind is str else f"one {type(given).__name__}"  # a case takes many lines
                raise StudyError(f"{what} is {words}; give a tuple of them")
            odd = [item for item in given if not isinstance(item, kind) and not (kind is str and _is_metric(item))]
            if odd:
                raise StudyError(f"{what} holds {odd[0]!r}, which is not a {kind.__name__}")
        for status in self.expects:
            lookup(status, [str(each) for each in Status], "status that a study expects")

    def smoke(self) -> "Study":
        """The same study on small meshes, few frames and the two coarsest reference meshes: does it work at all?"""
        small = {case.key: case for case in map(smoke_case, self.cases)}
        return replace(self, cases=tuple(small.values()))

    def accepts(self, status: str) -> bool:
        """Whether a case may end so."""
        return self.counts_losses or status in (Status.OK, Status.SKIPPED, *self.expects)

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes of the cases, each once."""
        return tuple({case.scene.name: case.scene for case in self.cases}.values())


def command_line(verb: str, studies: Sequence[Study], *options: str, elsewhere: bool = False) -> str:
    """The line for a shell that calls a command with studies, such as "organbench run FILE.py --case NAME".

    elsewhere: whether others read the line, on a page or in an archive; it then has of an absolute path the last part
    alone.
    """
    words = [word_elsewhere(study) if elsewhere else study.word or study.name for study in studies]
    return shlex.join(["organbench", verb, *words, *options])


def word_elsewhere(study: Study) -> str:
    """What the command line calls a study: its name, FILE.py, or NAME@FOLDER; of an absolute path the last part."""
    name, on, path = (study.word or study.name).rpartition("@")
    return name + on + (Path(path).name if Path(path).is_absolute() else path)


def _is_metric(item: object) -> bool:
    """As `studies.metrics.metric.Metric` is, which takes half a second to load."""
    return callable(getattr(item, "of", None)) and isinstance(getattr(item, "name", None), str)


def smoke_nodes(case: Case) -> int:
    """Surface nodes of a smoke run, of a quadratic body with those between its vertices."""
    linear = SMOKE_NODES, SMOKE_NODES_CUT, SMOKE_NODES_HOLLOW
    few, few_cut, few_hollow = SMOKE_QUADRATIC if case.body.kind == "quadratic" else linear
    return few_hollow if case.scene.lumen else few_cut if case.scene.cuts else few


def smoke_case(case: Case) -> Case:
    """A case small enough for a smoke run."""
    plan = case.scene.reference
    coarse = plan.smaller() if plan is not None else None
    regions = min(case.body.regions, smoke_nodes(case) // 3)
    fewer = {"regions": regions} if isinstance(case.body, TetrahedralBody) else {}
    return case.replaced(
        scene=replace(case.scene, reference=coarse),
        body=replace(case.body, nodes=min(case.body.nodes, smoke_nodes(case)), **fewer),
        frames=min(case.frames or case.scene.frames, SMOKE_FRAMES),
    )
