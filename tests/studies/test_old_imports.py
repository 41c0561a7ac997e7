"""A study file written for version 0.1 learns where a module is now."""

from importlib import import_module
from importlib.util import find_spec

import pytest

from studies.base.moved import MODULES, NAMES, RENAMED
from studies.base.old_imports import advice

LEARNED = {
    "from studies.case import Case": (
        "studies.case is now studies.runs.case; write `from studies.runs.case import Case`"
    ),
    "from massspring.obstacles import Path": (
        "massspring.obstacles is now massspring.world.trajectories; "
        "write `from massspring.world.trajectories import Trajectory as Path`"
    ),
    "from massspring import Path": (
        "massspring.Path is now massspring.Trajectory; write `from massspring import Trajectory as Path`"
    ),
    "from studies import Probed as Force, Scene": (
        "studies.Probed is now studies.ForceOutput; write `from studies import ForceOutput as Force, Scene`"
    ),
    "from reference_fem import ReferenceProblem": (
        "reference_fem.ReferenceProblem is now reference_fem.SolveError; "
        "write `from reference_fem import SolveError as ReferenceProblem`"
    ),
    "from studies.scenes.base import (\n    Scene,\n    Tissue as Soft,\n)": (
        "studies.scenes.base is now studies.scene.scene and studies.scene.tissues; "
        "write `from studies.scene.scene import Scene` and `from studies.scene.tissues import Tissue as Soft`"
    ),
    "from studies.case import *": "studies.case is now studies.runs.case; write `from studies.runs.case import *`",
    "import studies.case as c": "studies.case is now studies.runs.case; write `import studies.runs.case as c`",
    "from studies import case, adapt": (
        "studies.case is now studies.runs; write `from studies.runs import case, prepare as adapt`"
    ),
    "from studies.metrics import Metric": (
        "studies.metrics is now studies.metrics.metrics; write `from studies.metrics.metrics import Metric`"
    ),
    "from studies.geometry.levelset import Shape": (
        "studies.geometry.levelset is now studies.geometry.shape.levelset; "
        "write `from studies.geometry.shape.levelset import Shape`"
    ),
    "from massspring.laws import van_gelder, WITHOUT_LENGTH": (
        "massspring.laws is now massspring.body.laws; write `from massspring.body.laws import van_gelder`; "
        "WITHOUT_LENGTH is gone"
    ),
}
SILENT = ("import numpyy", "from studies.metrics import Metricc", "from studies.runs.case import Casee", "x = 1")


@pytest.mark.parametrize(("line", "sentence"), LEARNED.items())
def test_an_old_import_is_refused_with_the_new_one(line, sentence, refused, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(f'"""Mine."""\n{line}\nSTUDY = 1\n')
    assert refused("run", file) == (
        f"organbench: mine.py cannot be loaded: in line 2, {sentence}; mend it and run again"
    )


@pytest.mark.parametrize("line", LEARNED)
def test_what_it_advises_can_be_imported(line):
    for statement in str(advice(line, 1)).split("`")[1::2]:
        exec(statement, {})


@pytest.mark.parametrize("line", SILENT)
def test_other_mistakes_keep_their_own_sentence(line):
    assert advice(line, 1) is None


def test_the_table_leads_to_what_is_there():
    assert [new for new in MODULES.values() if find_spec(new) is None] == []
    for old, new in NAMES.items():
        name = old.rpartition(".")[2]
        assert hasattr(import_module(new), RENAMED.get(f"{new.split('.')[0]}.{name}", name)), old
    for old, new in RENAMED.items():
        package, _, name = old.partition(".")
        moved = [home for full, home in NAMES.items() if home.startswith(package) and full.endswith(f".{name}")]
        homes = [package, *moved]
        assert any(hasattr(import_module(home), new) for home in homes), old
        assert not any(hasattr(import_module(home), name) for home in homes), old


def test_the_table_holds_only_what_has_moved():
    """A package may have the name of an old module; the module itself is gone."""
    for old in MODULES:
        top, _, name = old.rpartition(".")
        spec = find_spec(old) if find_spec(top) is not None and find_spec(top).submodule_search_locations else None
        assert spec is None or spec.submodule_search_locations is not None, old
        assert MODULES[old] != old, name
