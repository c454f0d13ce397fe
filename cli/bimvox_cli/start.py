"""The entry point of ``bimvox``: it imports next to nothing before Ctrl-C is handled."""

# What `signal` wraps. That imports `enum` and half a dozen others, in which a Ctrl-C is a traceback.
import _signal  # type: ignore[import-not-found]
import os
import sys


def main() -> None:
    """Run the command line of the process and exit with its code."""
    deaf = _signal.getsignal(_signal.SIGINT) is not _signal.default_int_handler  # started in the background
    if not deaf:
        _signal.signal(_signal.SIGINT, _leave)
    import atexit
    import logging
    import warnings

    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # they speak to the authors of libraries; -W shows them
        logging.lastResort = None  # the same as lines in a log
    from bimvox_cli.main import run

    code = run()
    if not deaf:
        _signal.signal(_signal.SIGINT, _leave_quietly)
        # At its very end, Python gives the system's handler back, which would kill a process that is done.
        atexit.register(_signal.signal, _signal.SIGINT, _signal.SIG_IGN)
    sys.exit(code)


def _leave(*_: object) -> None:
    """Leave at once: nothing was begun, so nothing is to be tidied up."""
    _say(2, "error: interrupted; every output file is complete or unchanged\n")
    if "--json" in sys.argv:
        _say(1, '{"error": {"code": "interrupted", "message": "interrupted", "hint": null, "exit_code": 130}}\n')
    _leave_quietly()


def _say(stream: int, text: str) -> None:
    try:  # noqa: SIM105  (contextlib is not imported yet)
        os.write(stream, text.encode())
    except OSError:  # closed, full, or nobody reads it
        pass


def _leave_quietly(*_: object) -> None:
    os._exit(130)
