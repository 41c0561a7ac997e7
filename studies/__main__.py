"""Entry point of `organbench`: listens for Ctrl-C before the second that loading takes."""

import sys

from studies.base import interrupts


def main() -> None:
    """Loads the command line and runs it; exit codes as studies.cli.app.main."""
    with interrupts.listening():
        try:
            from studies.cli import app as cli

            interrupts.stop_if_pressed()
        except BaseException:  # a library may have made something else of it
            if not interrupts.pressed():
                raise
            interrupts.close_ears()
            print("organbench: interrupted before anything was begun", file=sys.stderr)
            sys.exit(interrupts.CODE)
        cli.main()


if __name__ == "__main__":
    main()
