"""The entry point of the command: ready for an interrupt before anything else is imported."""

import atexit
import gc
import os
import signal
import sys

INTERRUPTED = 130  # as in console.py, whose libraries are not there yet


def main() -> None:
    """Run the command line; while it is being imported, which takes a while, an interrupt ends the process at once."""
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, _leave)
    gc.set_threshold(50_000)  # what is imported stays, and to look for garbage in it takes longer than most commands;
    atexit.register(gc.freeze)  # at the end too
    os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "4")  # its threads wait asleep, where they would spin for 30 ms
    # imported here and not above, where an interrupt could not be answered
    from fmu_models.base.help_pages import with_pages

    def run() -> None:
        from fmu_models.base import console
        from identification.commands import application

        asked = application.only(sys.argv[1:])
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        console.run(asked)

    with_pages(sys.argv[1:], run)


def _leave(*_: object) -> None:
    os.write(2, b"stickslip: interrupted; nothing was begun.\n")
    os._exit(INTERRUPTED)
