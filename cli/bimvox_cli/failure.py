"""Message and exit code of an error.

==== ==========================================================
  0  done
  1  no valid plan, or a check failed
  2  bad usage or bad input
 70  a fault of bimvox itself (``EX_SOFTWARE`` of sysexits.h)
129  ended by SIGHUP: the terminal was closed
130  interrupted (Ctrl-C)
141  the reader of stdout has left (`bimvox ... | head -1`)
143  ended by SIGTERM
==== ==========================================================

From 129 on, the code is 128 plus the number of the signal, as for the commands of the system.
"""

from __future__ import annotations

import errno
import os
import re
import signal
import sys
import traceback
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import typer

from bimvox.errors import BimvoxError, PlanningError, cut, shown
from bimvox.files import HINT_FOR_NO_FOLDER, NO_CURRENT_FOLDER, current_folder_is_gone, reason_of
from bimvox.rendering.words import plain
from bimvox_cli.streams import StdoutError

DONE = 0
NO_PLAN = 1
BAD_INPUT = 2
FAULT = 70
INTERRUPTED = 130


_BEYOND_US = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.ENAMETOOLONG, errno.ELOOP, errno.EROFS})
"""What the system refuses wherever it happens: a full or read-only disk, a path that cannot be."""
_VARIABLES = {
    "NUMBA_NUM_THREADS": ("Number of threads specified", "a number of threads from 1"),
    "MPLBACKEND": ("Key backend:", "a backend of matplotlib"),
    "SOURCE_DATE_EPOCH": ("invalid literal for int()", "a number of seconds"),
}
"""How a library refuses the value of an environment variable, and what that should be."""
_MOST = 4000
"""Characters of a message that are printed; a file may contain a name of any length."""
_CODES_WITHOUT_PLAN = frozenset([PlanningError.code, *(kind.code for kind in PlanningError.__subclasses__())])
_CODE_OF_EVENT = {"rejected": BAD_INPUT, "failed": NO_PLAN}


def exit_code_of(document: Mapping[str, Any]) -> int:
    """Return the exit code of a command that finished with this document.

    It is 1 if a proof failed or a lift is infeasible; for an event of a watch, 2 if the file was rejected and 1 if
    there is no plan for it; for many runs, the worst that one of them alone would have.
    """
    failed = [_code_of_run(code) for _, code, _ in failed_runs(document)]
    if failed:
        return max(failed)
    event = _CODE_OF_EVENT.get(str(document.get("event")))
    if event is not None:
        return event
    return NO_PLAN if document.get("verified") is False or document.get("infeasible") else DONE


def failed_runs(document: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Return name, code and message of each run, or site of ``optimise``, that failed; none for any other document."""
    if not document.get("failed"):
        return []
    runs = [
        (run["run"], run["error"]["code"], run["error"]["message"]) for run in document.get("runs", ()) if run["error"]
    ]
    sites = [(one["name"], one["error_code"], one["error"]) for one in document.get("sites", ()) if one["error"]]
    return [*runs, *sites]


def report_runs(document: Mapping[str, Any]) -> None:
    """Print on stderr that runs failed, with the first reason; the table and the document have all."""
    failed = failed_runs(document)
    if failed:
        name, _, message = failed[0]
        count = len(document.get("runs") or document["sites"])
        print(f"error: {len(failed):,} of {count:,} failed; {name}: {cut(plain(message), _MOST)}", file=sys.stderr)


def _code_of_run(code: str) -> int:
    """Return the exit code of one run by the code of its error; a run whose process died has no plan."""
    if code == "fault":
        return FAULT
    return NO_PLAN if code == "died" or code in _CODES_WITHOUT_PLAN else BAD_INPUT


def report(error: BaseException, *, as_json: bool, verbose: bool = False) -> int:
    """Print on stderr what went wrong and what to do, with JSON also a document on stdout; return the exit code.

    ``verbose`` prints where a fault of bimvox happened (a traceback), never for other errors.
    """
    code, message, hint, exit_code, evidence = _described(error)
    if as_json:
        from bimvox_cli.output import print_json

        with suppress(StdoutError, SystemExit):  # the first error is the one to report
            print_json({"error": {"code": code, "message": message, "hint": hint, **evidence, "exit_code": exit_code}})
            sys.stdout.flush()
    print(f"error: {cut(plain(message), _MOST)}", file=sys.stderr)
    if hint:
        print(f"  hint: {cut(plain(hint), _MOST)}", file=sys.stderr)
    if exit_code == FAULT and verbose:
        traceback.print_exception(error, file=sys.stderr)
    return exit_code


def _described(error: BaseException) -> tuple[str, str, str | None, int, dict[str, Any]]:
    """Return an error's code, message, hint, exit code and evidence."""
    if isinstance(error, BimvoxError):
        evidence = {
            key: _plain(value)
            for key, value in vars(error).items()
            if key not in ("message", "hint") and not key.startswith("_")
        }
        return error.code, error.message, error.hint, _exit_code_of_error(error), evidence
    if isinstance(error, typer.TyperException):
        return "usage", _usage_message(error), _usage_hint(error), BAD_INPUT, {}
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", "interrupted; every output file is complete or unchanged", None, INTERRUPTED, {}
    if isinstance(error, SystemExit) and isinstance(error.code, int):
        name = signal.Signals(error.code - 128).name
        return "interrupted", f"ended by {name}; every output file is complete or unchanged", None, error.code, {}
    if isinstance(error, OSError) and error.errno in _BEYOND_US:
        where = f"{error.filename}: " if isinstance(error.filename, str) else ""
        hint = "free some space, or name another file or folder (TMPDIR is the one for temporary files)"
        return "file", f"{where}{reason_of(error)}; no output was changed", hint, BAD_INPUT, {}
    if isinstance(error, FileNotFoundError) and current_folder_is_gone():
        return "file", NO_CURRENT_FOLDER, HINT_FOR_NO_FOLDER, BAD_INPUT, {}
    if isinstance(error, MemoryError):
        said = "this needs more memory than there is"
        return "memory", said, "take larger cells, or a smaller site or model", BAD_INPUT, {}
    for name, (refusal, meant) in _VARIABLES.items():
        if isinstance(error, ValueError) and str(error).startswith(refusal) and name in os.environ:
            said = f"the environment variable {name} is {shown(os.environ[name])}, not {meant}"
            return "environment", said, "unset it", BAD_INPUT, {}
    message = f"sorry, bimvox failed: {type(error).__name__}: {error}".splitlines()[0]
    return "fault", message, "this is a fault of bimvox; -v shows where", FAULT, {}


def _exit_code_of_error(error: BimvoxError) -> int:
    return NO_PLAN if isinstance(error, PlanningError) else BAD_INPUT


def _usage_message(error: typer.TyperException) -> str:
    """Return typer's message in the form of our own: lower case, no full stop, no unset environment variables."""
    text = error.message if getattr(error, "possibilities", None) else error.format_message()
    text = text.replace("Value error, ", "").replace("Input should", "it should")
    text = re.sub(r"it should be a valid (integer|number), unable to parse string as an? \w+", r"not a \1", text)
    text = text.replace("not a integer", "not a whole number")
    for name in re.findall(r"\(env var: '(\w+)'\)", text):
        if name not in os.environ:
            text = text.replace(f" (env var: '{name}')", "")
    text = text.strip().rstrip(".")
    return text[:1].lower() + text[1:]


def _usage_hint(error: typer.TyperException) -> str:
    near = getattr(error, "possibilities", None)
    if near:
        return f"did you mean {' or '.join(sorted(near))}?"
    context = getattr(error, "ctx", None)
    return f"{context.command_path if context else 'bimvox'} -h shows the usage"


def _plain(value: Any) -> Any:
    """Return a piece of evidence as JSON values."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list | set | frozenset):
        return [_plain(item) for item in value]
    return value if value is None or isinstance(value, str | int | float | bool) else str(value)
