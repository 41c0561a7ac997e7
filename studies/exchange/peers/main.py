"""`python -m studies.exchange.peers.main`: every other program, and ours, on the open scenes of the frozen set.

With `--sweep` a search of their settings on two scenes.
"""

import sys
import tempfile
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.exchange.league import FOLDER
from studies.exchange.league.frozen import frozen
from studies.exchange.peers.contest import OURS, PEERS, TIME_LIMIT, Attempt, contest
from studies.exchange.peers.sweep import NODES, swept
from studies.scene.library import SCENES

TABLE = "sweep.csv"


def main(
    results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results"),
    only: Annotated[str, typer.Option(help="one program by its name")] = "",
    limit: Annotated[float, typer.Option(min=1.0, help="seconds after which a run is ended")] = TIME_LIMIT,
    sweep: Annotated[bool, typer.Option("--sweep", help="search the settings of each on two scenes")] = False,
    nodes: Annotated[int, typer.Option(help="vertices on the outer surface")] = NODES,
    again: Annotated[bool, typer.Option("--again", help="also what is current")] = False,
    environments: Annotated[Path | None, typer.Option(help="folder of the programs' environments")] = None,
) -> None:
    """Exports the scenes, runs the programs, judges and stores what they hand in as entries.

    Entries of the present code are kept, so that the same command goes on after an interruption.
    """
    peers = PEERS if sweep else (*PEERS, *OURS)
    if only:
        lookup(only, [peer.name for peer in peers], "program (--only)")
    chosen = [peer for peer in peers if only in ("", peer.name)]
    homes = environments or results / "cache" / "environments"
    with tempfile.TemporaryDirectory() as folder:
        if sweep:
            table = results / FOLDER / TABLE
            rows = kept_rows(table, [peer.name for peer in chosen])
            table.parent.mkdir(parents=True, exist_ok=True)
            for peer in chosen:
                for row in () if peer.absent else swept(peer, Path(folder), limit, homes):
                    rows.append(row)
                    pd.DataFrame(rows).to_csv(table, index=False, float_format="%.6g")
                    print(row, flush=True)
            return
        scenes = [scene for scene in SCENES if scene.name in frozen()]
        attempts = [Attempt(peer, scene, nodes) for peer in chosen for scene in scenes]
        for record in contest(results / FOLDER, attempts, Path(folder), limit, homes, again):
            print(f"{record.name}: {record.status}" + (f", {record.message}" if record.message else ""), flush=True)


def kept_rows(table: Path, again: list[str]) -> list[dict[str, Any]]:
    """Rows of a table of settings, without those of programs that are tried again."""
    if not table.is_file():
        return []
    return [row for row in pd.read_csv(table).to_dict("records") if row["engine"] not in again]


if __name__ == "__main__":
    try:
        typer.run(main)
    except StudyError as problem:
        print(f"peers: {problem}", file=sys.stderr)
        sys.exit(2)
