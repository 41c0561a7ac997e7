"""What `organbench show` says of a record."""

from rich.console import Console

from studies.cli.record_text import describe
from studies.store.record import Status
from tests.studies.store.test_links import store


def shown(tree) -> str:
    console = Console(width=160, color_system=None)
    with console.capture() as capture:
        console.print(tree)
    return capture.get()


def test_show_tells_status_units_and_numbers(tmp_path):
    path = store(tmp_path, "ball/free", '{"a": 1}', Status.DIVERGED, "at t = 0.2 s [m]")
    text = shown(describe(path, every=True))
    for part in (
        "ball/free",
        "diverged: at t = 0.2 s [m]",
        "worst = 0.000125",
        "m^3",
        "enclosed volume",
        "0.5",
        "not finite: 1 of ",
    ):
        assert part in text, part
