"""What all tests share: artefacts made once per run by whichever process asks first, and a list of what compiles."""

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from numba.core import event

from studies.base import processes
from studies.base.compile_watch import EVENT, Compiled, CompileWatch, summary
from studies.geometry.mesher import process
from tests import copies

PATIENCE = 900.0
"""Seconds that a process waits for what another one makes; the longest takes a minute on a busy machine."""
COSTLY = {"browser", "scheduler", "wheel", "written"}
"""Fixtures that start a browser or a Dask cluster, build a wheel, run a notebook: what asks for one is a campaign."""
SLOW = 40
"""A test with the marker `slow` takes as long as so many without."""
COMPILED = pytest.StashKey[list[Compiled]]()


@contextmanager
def locked(path: Path, patience: float = PATIENCE) -> Iterator[None]:
    """Holds a lock file, which one process at a time can have. Fails where another one keeps it for `patience` [s]."""
    waited_until = time.monotonic() + patience
    while True:
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL))
            break
        except FileExistsError:
            if time.monotonic() > waited_until:
                pytest.fail(
                    f"{path.name} was held for {patience:g} s: the process that makes it is stuck or was killed"
                )
            time.sleep(0.05)
    try:
        yield
    finally:
        path.unlink()


def once_per_run(root: Path, name: str, make: Callable[[Path], object]) -> Path:
    """Folder root/name, filled by `make`: by the process that asks first, while the others wait.

    What fails leaves nothing, so that the next one fails with its own error.
    """
    folder, part = root / name, root / f"{name}.part"
    with locked(root / f"{name}.lock"):
        if not folder.exists():
            shutil.rmtree(part, ignore_errors=True)
            part.mkdir()
            make(part)
            part.rename(folder)
    return folder


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of this run of the tests, the same for all its processes."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture(scope="session", autouse=True)
def mesh_cache(run_folder: Path) -> Iterator[Path]:
    """A mesh cache of this run: every mesh is really made, once, also for the processes that a test starts."""
    folder = run_folder / "meshes"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ORGANBENCH_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session", autouse=True)
def copied_processes() -> Iterator[None]:
    """The mesher and processes of a sweep are copies; tests of either, and a command in a process, start new ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(process, "subprocess", copies)
        patch.setattr(processes, "SPAWN", copies.Sweeping)
        yield


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks campaigns by the costly fixtures that they use, and begins with the files that take longest.

    A process takes a whole file at a time: a long one at the end would leave the others without work.
    """
    weights: dict[Path, int] = {}
    for item in items:
        if COSTLY & set(getattr(item, "fixturenames", ())):
            item.add_marker("campaign")
        if item.get_closest_marker("campaign") is None:
            weight = SLOW if item.get_closest_marker("slow") is not None else 1
            weights[item.path] = weights.get(item.path, 0) + weight
    items.sort(key=lambda item: -weights.get(item.path, 0))


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--compiled N`: what the run still had to compile."""
    parser.addoption("--compiled", type=int, metavar="N", help="list the N functions that took longest to compile")


def pytest_configure(config: pytest.Config) -> None:
    """Listens to numba's compiler where `--compiled` is given."""
    watch = CompileWatch()
    config.stash[COMPILED] = watch.compiled
    if config.getoption("--compiled") is not None:
        event.register(EVENT, watch)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node, error) -> None:
    """A process of pytest-xdist ends: its list joins the others."""
    sent = getattr(node, "workeroutput", {}).get("compiled", [])
    node.config.stash[COMPILED] += [Compiled(*entry) for entry in sent]


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Sends the list to the process that prints it."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["compiled"] = [tuple(entry) for entry in session.config.stash[COMPILED]]


def pytest_terminal_summary(terminalreporter, config: pytest.Config) -> None:
    """Prints the list."""
    most = config.getoption("--compiled")
    if most is not None:
        terminalreporter.section("compiled")
        for line in summary(config.stash[COMPILED], most):
            terminalreporter.line(line)
