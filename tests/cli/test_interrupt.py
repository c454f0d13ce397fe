"""Ctrl-C while a geometry kernel works leaves no process and no file behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"

_HANGS = """
import os, sys, time
from multiprocessing.connection import Connection
from bimvox.bim.ifc.forks import serve

def mesh(step_ids, library):
    with open(os.environ["TOLD"], "a") as told:
        told.write(f"{os.getppid()} {os.getpid()}\\n")
    time.sleep(600)

serve(Connection(int(sys.argv[1])), mesh)
"""
_RUN = """
import signal, sys
# What a shell starts in the background inherits a deaf ear for Ctrl-C; a terminal's child does not.
signal.signal(signal.SIGINT, signal.default_int_handler)
from bimvox.bim.ifc.geometry import GeometryPool
from bimvox_cli.main import run

GeometryPool.__init__.__kwdefaults__["command"] = (sys.executable, "-c", sys.argv[1])
sys.exit(run(["voxelize", *sys.argv[2:]]))
"""


def _to_the_process(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)


def _to_the_group(process: subprocess.Popen[str]) -> None:
    os.killpg(process.pid, signal.SIGINT)


def _terminate(process: subprocess.Popen[str]) -> None:
    process.terminate()


@pytest.mark.parametrize(
    ("interrupt", "code"),
    [
        pytest.param(_to_the_process, 130, marks=pytest.mark.slow),
        (_to_the_group, 130),
        pytest.param(_terminate, 143, marks=pytest.mark.slow),
    ],
)
def test_nothing_stays(tmp_path: Path, interrupt: Callable[[subprocess.Popen[str]], None], code: int) -> None:
    told, scratch, out = tmp_path / "told", tmp_path / "tmp", tmp_path / "out"
    scratch.mkdir()
    out.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-c", _RUN, _HANGS, str(MODEL), "-o", str(out / "grid.zarr.zip"), "--processes", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=out,
        env={**os.environ, "TOLD": str(told), "TMPDIR": str(scratch)},
        start_new_session=True,
    )
    patience_s = time.monotonic() + 120.0
    while not (told.exists() and told.read_text().endswith("\n")):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < patience_s
        time.sleep(0.05)
    pids = {int(word) for word in told.read_text().split()}
    assert all(map(_runs, pids))
    interrupt(process)
    _, said = process.communicate(timeout=60)
    assert process.returncode == code
    assert "Traceback" not in said
    patience_s = time.monotonic() + 30.0
    while any(map(_runs, pids)) and time.monotonic() < patience_s:
        time.sleep(0.05)
    assert not any(map(_runs, pids))
    assert not list(scratch.iterdir())
    assert not list(out.iterdir())


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        # A zombie that is not reaped yet is not a running process.
        return "zombie" not in Path(f"/proc/{pid}/status").read_text() if Path("/proc/self").exists() else True
    except (ProcessLookupError, FileNotFoundError):
        return False
