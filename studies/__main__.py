"""Entry point of `organbench`."""

from studies.base import interrupts
from studies.cli import app


def main() -> None:
    """Runs the command line; exit codes as studies.cli.app.main."""
    with interrupts.listening():
        app.main()


if __name__ == "__main__":
    main()
