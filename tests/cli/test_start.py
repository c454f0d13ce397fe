"""Ctrl-C while the program starts: at every import, and at any moment."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterable

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals")

_AT_AN_IMPORT = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)

class Interrupting:
    def __init__(self, at):
        self.at = at
    def find_spec(self, name, path=None, target=None):
        self.at -= 1
        if self.at == 0:
            os.kill(os.getpid(), signal.SIGINT)

for at in map(int, sys.argv[1].split(",")):
    child = os.fork()
    if child == 0:
        from bimvox_cli.start import main
        sys.meta_path.insert(0, Interrupting(at))
        sys.argv[1:] = ["schema", "site"]
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        main()
    print(at, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


def _interrupted_at_imports(numbers: Iterable[int]) -> dict[int, int]:
    done = subprocess.run(
        [sys.executable, "-c", _AT_AN_IMPORT, ",".join(map(str, numbers))], capture_output=True, text=True, check=True
    )
    assert set(done.stderr.splitlines()) <= {"error: interrupted; every output file is complete or unchanged"}
    return {int(at): int(code) for at, code in map(str.split, done.stdout.splitlines())}


def test_ctrl_c_at_an_import_is_quiet() -> None:
    assert set(_interrupted_at_imports((1, 60, 120, 250)).values()) == {130}


@pytest.mark.slow
def test_ctrl_c_at_any_import_is_quiet() -> None:
    codes = _interrupted_at_imports(range(2, 900, 30))
    assert set(codes.values()) == {130}


@pytest.mark.parametrize(
    "after_s", [0.0, 0.1, *(pytest.param(s, marks=pytest.mark.slow) for s in (0.05, 0.2, 0.4, 0.8))]
)
def test_ctrl_c_while_it_starts_is_quiet(after_s: float) -> None:
    # The interpreter takes 0.05 s to start, before any code of bimvox.
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from bimvox_cli.start import main; print('on', flush=True); main()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, "policy", "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "on\n"
    time.sleep(after_s)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert "Traceback" not in said
    assert process.returncode in ((130,) if after_s < 0.08 else (0, 130))


def test_it_imports_nothing_of_its_own_before_ctrl_c_is_handled() -> None:
    code = "import sys; before = set(sys.modules); import bimvox_cli.start; print(*set(sys.modules) - before)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path[:] = {sys.path!r}; {code}"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert not {"signal", "enum", "functools", "collections", "re"} & set(done.stdout.split())
