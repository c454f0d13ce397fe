"""The entry point of ``bimvox``: it imports next to nothing before Ctrl-C is handled."""

import _thread
import atexit
import os
import signal
import sys
import time

_MEANWHILE_S = 0.01


def main() -> None:
    """Run the command line of the process and exit with its code."""
    deaf = signal.getsignal(signal.SIGINT) is not signal.default_int_handler  # started in the background
    if not deaf:
        signal.signal(signal.SIGINT, _leave)
    sys.unraisablehook = _raise_again
    try:
        import logging
        import warnings

        if not sys.warnoptions:
            warnings.simplefilter("ignore")  # they speak to the authors of libraries; -W shows them
            logging.lastResort = None  # the same as lines in a log
        from bimvox_cli.main import run

        if not deaf:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        code = run()
        if not deaf:
            signal.signal(signal.SIGINT, _leave_quietly)
            # At its very end, Python gives the system's handler back, which would kill a process that is done.
            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        _leave()
    sys.exit(code)


def _leave(*_: object) -> None:
    """Leave at once: nothing was begun, so nothing is to be tidied up."""
    if "--json" in sys.argv:
        text = '{"error": {"code": "interrupted", "message": "interrupted", "hint": null, "exit_code": 130}}\n'
        os.write(1, text.encode())
    os.write(2, b"error: interrupted; every output file is complete or unchanged\n")
    _leave_quietly()


def _leave_quietly(*_: object) -> None:
    os._exit(130)


def _raise_again(unraisable: "sys.UnraisableHookArgs") -> None:
    """Bring a Ctrl-C or SIGTERM that a callback swallowed back to the main thread, without a traceback."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        _thread.start_new_thread(_interrupt, (signal.SIGINT,))
    elif issubclass(unraisable.exc_type, SystemExit):
        _thread.start_new_thread(_interrupt, (signal.SIGTERM,))
    else:
        sys.__unraisablehook__(unraisable)


def _interrupt(number: signal.Signals) -> None:
    """Interrupt the main thread when it has left the hook: there, the exception would be swallowed again."""
    time.sleep(_MEANWHILE_S)
    if sys.platform == "win32":
        _thread.interrupt_main(number)
    else:
        os.kill(os.getpid(), number)  # unlike interrupt_main, it ends a wait
