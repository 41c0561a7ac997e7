"""`python -m studies.sweep.compiling.main`: compiles what `make study` and `make test` need; silent when done."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from studies.base.atomic import write_whole
from studies.base.errors import StudyError
from studies.base.interrupts import exit_code, listening
from studies.base.processes import run_each
from studies.sweep.compiling.log import listing, summary
from studies.sweep.compiling.tasks import ESSENTIAL, Done, is_done, perform, set_done, tasks

PROCESSES = 2


def compile_all(names: list[str]) -> Iterator[Done]:
    """Does the tasks in two processes; yields each as it is done. Raises StudyError for one that fails."""
    for name, done, cause in run_each(names, PROCESSES, compile_one):
        if cause is not None:
            raise StudyError(f"{name} could not be compiled: {cause}; run the command again")
        yield done


def compile_one(name: str) -> Done:
    """In a process: does one task. Raises StudyError where it fails."""
    try:
        return perform(name)
    except MemoryError:
        raise
    except Exception as error:  # numba raises errors of many types
        words = " ".join(str(error).split())
        raise StudyError(f"{name} could not be compiled: {type(error).__name__}: {words}") from error


def show(position: str, done: Done) -> None:
    """A line for a task that compiled something."""
    if done.compiled:
        own = sum(entry.seconds for entry in done.compiled)
        print(f"compiling {position}: {done.name}: {len(done.compiled)} functions, {own:.1f} s", flush=True)


def run(whole: bool, table: Path | None = None) -> None:
    """Compiles what is missing, with a line for each task that had to; `table`: where to list every function."""
    names = list(tasks()) if whole else list(ESSENTIAL)
    print(
        f"compiling: up to {len(names)} forms of the kernels in {PROCESSES} processes, once for this code", flush=True
    )
    begin, compiled = perf_counter(), []
    for number, done in enumerate(compile_all(names), 1):
        show(f"{number}/{len(names)}", done)
        compiled += done.compiled
        if table is not None:
            write_whole(table, listing(compiled).encode())
    set_done(whole)
    print(f"compiling: {summary(compiled, 0)[0]}; {perf_counter() - begin:.0f} s in all", flush=True)


def bring_up_to_date(whole: bool) -> None:
    """Compiles what is missing of all, or of what is essential; nothing where that was done before."""
    if not is_done(whole):
        run(whole)


def main() -> None:
    """Exit codes: 0 all is compiled; 1 something could not be; 130 interrupted."""
    parser = argparse.ArgumentParser(prog="python -m studies.sweep.compiling.main", description=__doc__)
    parser.add_argument("--essential", action="store_true", help="only what the main studies need first")
    parser.add_argument("--again", action="store_true", help="repeat tasks that are already done")
    parser.add_argument("--table", type=Path, metavar="FILE", help="list every function that is compiled in a CSV file")
    options = parser.parse_args()
    whole = not options.essential
    if is_done(whole) and not options.again:
        return
    try:
        with listening():
            run(whole, options.table)
    except StudyError as error:
        print(f"organbench: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("organbench: interrupted; compiled functions are kept", file=sys.stderr)
        sys.exit(exit_code())


if __name__ == "__main__":
    main()
