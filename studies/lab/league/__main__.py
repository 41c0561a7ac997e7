"""`python -m studies.lab.league`: every other program, and ours, on the open scenes of the frozen set.

With `--sweep` a search of the settings of the others on two scenes. Entries of the present settings are kept, so that
the same command goes on after an interruption; what was skipped is tried again, for what it lacked may be there now.
"""

import argparse
import json
import tempfile
from pathlib import Path

import pandas as pd

from studies import SCENES, Status, read_record
from studies.exchange.league import LEAGUE, SET, frozen
from studies.lab.league.programs import OURS, PROGRAMS, TIME_LIMIT, Program, Surroundings, entered
from studies.lab.league.sweep import NODES, swept
from studies.lab.refusal import refusal

TABLE = "sweep.csv"


def main() -> None:
    """Runs what the command line asks for; exports go to a temporary folder."""
    parser = argparse.ArgumentParser(prog="python -m studies.lab.league", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--only", choices=[program.name for program in (*PROGRAMS, *OURS)], help="one program")
    parser.add_argument("--limit", type=float, default=TIME_LIMIT, help="seconds after which a run is ended")
    parser.add_argument("--nodes", type=int, default=NODES, help="vertices on the outer surface")
    parser.add_argument("--sweep", action="store_true", help="search the settings of each on two scenes")
    parser.add_argument("--again", action="store_true", help="also what is there")
    parser.add_argument("--environments", type=Path, help="folder of the programs' environments")
    asked = parser.parse_args()
    programs = [one for one in (*PROGRAMS, *OURS) if asked.only in (None, one.name)]
    scenes = [one for one in SCENES if one.name in frozen()]
    with tempfile.TemporaryDirectory() as folder:
        at = Surroundings(Path(folder), asked.environments or asked.results / "cache" / "environments", asked.limit)
        if asked.sweep:
            write_sweep(
                asked.results / LEAGUE / TABLE, [one for one in programs if not one.ours and not one.absent], at
            )
            return
        there = set() if asked.again else settled(asked.results)
        for program in programs:
            for scene in scenes:
                if key(program, scene.name, asked.nodes) not in there:
                    run = entered(program, scene, asked.nodes, at, asked.results)
                    print(f"{run.record.name}: {run.record.status} {run.record.message}".rstrip(), flush=True)


def key(program: Program, scene: str, nodes: int) -> str:
    """What an attempt is known by: any change of it makes another attempt."""
    settings = dict(program.settings)
    return json.dumps([SET, program.name, program.version, program.mesh, nodes, scene, settings], sort_keys=True)


def settled(results: Path) -> set[str]:
    """Keys of the attempts that are entered in `results`, but for those that were skipped."""
    keys = set()
    for path in (results / LEAGUE / "entries").glob("*.h5"):
        record = read_record(path)
        one = json.loads(record.attributes[LEAGUE])
        if record.status != Status.SKIPPED:
            same = [one[name] for name in ("set", "engine", "version", "mesh", "nodes", "scene", "settings")]
            keys.add(json.dumps(same, sort_keys=True))
    return keys


def write_sweep(table: Path, programs: list[Program], at: Surroundings) -> None:
    """Writes the table row by row; rows of other programs stay."""
    rows = []
    if table.is_file():
        again = [program.name for program in programs]
        rows = [row for row in pd.read_csv(table).to_dict("records") if row["engine"] not in again]
    table.parent.mkdir(parents=True, exist_ok=True)
    for program in programs:
        for row in swept(program, at):
            rows.append(row)
            pd.DataFrame(rows).to_csv(table, index=False, float_format="%.6g")
            print(row, flush=True)


if __name__ == "__main__":
    with refusal("league"):
        main()
