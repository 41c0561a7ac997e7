"""`python -m studies.exchange.peers.main`: every other program on the ball and the liver, also with half its step."""

import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from studies.base.errors import StudyError
from studies.base.lookup import lookup
from studies.exchange.peers.contest import PEERS, TIME_LIMIT, Attempt, contest
from studies.exchange.peers.study import NODES, SCENES


def main(
    results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results"),
    only: Annotated[str, typer.Option(help="one program by its name")] = "",
    limit: Annotated[float, typer.Option(min=1.0, help="seconds after which a run is ended")] = TIME_LIMIT,
) -> None:
    """Exports the scenes, runs the programs, judges and stores what they hand in as entries."""
    if only:
        lookup(only, [peer.name for peer in PEERS], "program (--only)")
    attempts = [
        Attempt(peer, scene, nodes, shorter)
        for peer in PEERS
        if only in ("", peer.name)
        for scene in SCENES
        for nodes in NODES
        for shorter in ((1.0, 0.5) if nodes == NODES[0] and not peer.absent else (1.0,))
    ]
    with tempfile.TemporaryDirectory() as folder:
        for record in contest(results, attempts, Path(folder), limit):
            print(f"{record.name}: {record.status}" + (f", {record.message}" if record.message else ""), flush=True)


if __name__ == "__main__":
    try:
        typer.run(main)
    except StudyError as problem:
        print(f"peers: {problem}", file=sys.stderr)
        sys.exit(2)
