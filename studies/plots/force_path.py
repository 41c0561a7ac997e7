from pathlib import Path
from collections.abc import Sequence
from studies.metrics import Run
def draw(runs: Sequence[Run], path: Path) -> None: ...
