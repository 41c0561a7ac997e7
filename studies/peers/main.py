"""`python -m studies.peers.main`: every other program on the ball and the liver, also with half its step."""

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from studies.peers.contest import PEERS, Attempt, contest
from studies.peers.study import NODES, SCENES


def main(
    results: Annotated[Path, typer.Option(help="folder of the results")] = Path("results"),
    only: Annotated[str, typer.Option(help="one program by its name")] = "",
) -> None:
    """Exports the scenes, runs the programs, judges and stores what they hand in as entries."""
    attempts = [
        Attempt(peer, scene, nodes, shorter)
        for peer in PEERS
        if only in ("", peer.name)
        for scene in SCENES
        for nodes in NODES
        for shorter in ((1.0, 0.5) if nodes == NODES[0] and not peer.absent else (1.0,))
    ]
    with tempfile.TemporaryDirectory() as folder:
        for record in contest(results, attempts, Path(folder)):
            print(f"{record.name}: {record.status}" + (f", {record.message}" if record.message else ""), flush=True)


if __name__ == "__main__":
    typer.run(main)
