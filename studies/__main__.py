"""Entry point of `organbench`: listens for Ctrl-C before the second that loading takes."""

# Part of the interpreter: the module `signal` is a file, and Ctrl-C while it is read is a traceback.
import _signal  # pyright: ignore[reportMissingImports]
import os
import sys

BEFORE = b"organbench: interrupted before anything was begun\n"


def _leave(number: int, frame: object) -> None:
    os.write(2, BEFORE)
    os._exit(130)


if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, _leave)

from studies.base import interrupts  # noqa: E402


def main() -> None:
    """Loads the command line and runs it; exit codes as studies.cli.app.main."""
    if _signal.getsignal(_signal.SIGINT) is _leave:
        _signal.signal(_signal.SIGINT, _signal.default_int_handler)
    with interrupts.listening():
        try:
            from studies.cli import app as cli

            interrupts.stop_if_pressed()
        except BaseException:  # a library may have made something else of it
            if not interrupts.pressed():
                raise
            interrupts.close_ears()
            os.write(2, BEFORE)
            sys.exit(interrupts.exit_code())
        cli.main()


if __name__ == "__main__":
    main()
