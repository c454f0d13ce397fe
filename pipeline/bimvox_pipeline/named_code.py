"""Functions and models that the command line names: ``module:name``, or ``file.py:name``. Their code runs."""

from __future__ import annotations

import importlib
import json
import sys
from contextlib import contextmanager, redirect_stdout
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import BimvoxError, InputError, cut
from bimvox.files import read_input

if TYPE_CHECKING:
    from collections.abc import Iterator

HINT = "module:name or file.py:name, the module on Python's path or in the current folder"


def named_code(text: str, what: str, error: type[BimvoxError] = InputError) -> Any:
    """Return a function or a model by its name.

    Args:
        text: ``module:name`` of a module on Python's path or in the current folder, or ``file.py:name``.
        what: What it is for, as messages begin.
        error: The kind of error.

    Raises:
        BimvoxError: Of that kind, if there is no such name or its code cannot be run.
    """
    module, _, name = text.rpartition(":")
    if not module or not name:
        raise error(f"{what} {text}: not module:name", hint=HINT)
    try:
        with _current_folder(), redirect_stdout(sys.stderr):  # stdout is for the result
            home = _of_file(Path(module)) if module.endswith(".py") else importlib.import_module(module)
    except Exception as found:  # of anyone's code
        said = f"{type(found).__name__}: {cut(str(found), 200)}"
        raise error(f"{what} {text}: the module cannot be imported: {said}", hint=HINT) from found
    if not hasattr(home, name):
        raise error(f"{what} {text}: the module has no function {name!r}", hint=HINT)
    return getattr(home, name)


def named_order(text: str) -> Any:
    """Return what ``--order`` names: ids of a file, one a line or a JSON list, or a function that makes the order.

    Raises:
        BimvoxError: If the file cannot be read, or there is no such function.
    """
    if ":" in text and not Path(text).is_file():
        return named_code(text, "--order")
    content = read_input(Path(text)).decode("utf-8-sig", "replace")
    if not content.lstrip().startswith("["):
        return [line.strip() for line in content.splitlines() if line.strip()]
    try:
        found = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{text}: not a JSON list: {error}", hint="give the ids of all parts") from error
    return found


def _of_file(file: Path) -> Any:
    spec = spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is not a Python file")
    home = module_from_spec(spec)
    sys.modules.setdefault(file.stem, home)  # never in the place of another module
    spec.loader.exec_module(home)
    return home


@contextmanager
def _current_folder() -> Iterator[None]:
    sys.path.insert(0, "")
    try:
        yield
    finally:
        if "" in sys.path:
            sys.path.remove("")
