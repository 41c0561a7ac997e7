"""No file that another could have written is unpickled or evaluated: who does either is listed, with what it reads."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[3]
PACKAGES = ("massspring", "reference_fem", "studies")
ALLOWED = {
    "studies/runs/user_code.py": {"exec"},  # a FILE.py, which is a program
    "studies/base/processes.py": {"pickle.loads"},  # of the process that started it, and of those it started
    "studies/sweep/engines/cluster.py": {"pickle.loads"},  # of the workers of its scheduler
    "studies/sweep/engines/worker.py": {"pickle.loads"},  # of the client of its scheduler
}
DANGEROUS = {"pickle.loads", "pickle.load", "pickle.Unpickler", "eval", "exec", "pd.read_pickle", "marshal.loads"}
DANGEROUS |= {"yaml.unsafe_load", "yaml.full_load", "os.system", "shelve.open", "joblib.load"}


def calls(file):
    """(name, call) of every call in a file."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def test_who_unpickles_or_evaluates_is_listed():
    callers = {}
    for file in (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))):
        names = {name for name, _ in calls(file)} & DANGEROUS
        if names:
            callers[file.relative_to(ROOT).as_posix()] = names
    assert callers == ALLOWED


def test_arrays_and_settings_are_read_without_objects():
    for file in (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))):
        for name, call in calls(file):
            if name == "np.load":
                words = {word.arg: ast.unparse(word.value) for word in call.keywords}
                assert words.get("allow_pickle") == "False", f"{file}: {ast.unparse(call)}"
            if name == "yaml.load":
                assert "BaseLoader" in ast.unparse(call), f"{file}: {ast.unparse(call)}"
