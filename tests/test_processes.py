from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bimvox.processes import processors, python_module, run_to_end

PARENT = """
import os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1]])
print(child.pid, flush=True)
child.wait()
"""
CHILD = "import os, time; from bimvox.processes import end_with; end_with(os.getppid()); time.sleep(60)"


def test_a_command_returns_what_it_wrote_and_its_last_line():
    program = "import sys; print('out'); sys.stderr.write('first\\nlast\\n'); sys.exit(3)"
    done = run_to_end([sys.executable, "-c", program], 60.0)
    assert done is not None
    assert (done.code, done.out, done.last_line) == (3, b"out\n", "last")
    killed = run_to_end([sys.executable, "-c", "import os; os.kill(os.getpid(), 9)"], 60.0)
    assert killed is not None
    assert (killed.code, killed.last_line) == (-signal.SIGKILL, "")


def test_a_command_that_takes_too_long_is_killed():
    began = time.monotonic()
    assert run_to_end([sys.executable, "-c", "import time; time.sleep(60)"], 0.5) is None
    assert time.monotonic() - began < 30.0


def test_a_worker_finds_the_package_and_no_file_of_the_current_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "json.py").write_text("raise SystemExit('shadowed')\n")
    (tmp_path / "bimvox.py").write_text("raise SystemExit('shadowed')\n")
    done = run_to_end([sys.executable, "-c", "import json, bimvox; print(bimvox.__file__)"], 60.0)
    assert done is not None
    assert Path(done.out.decode().strip()) == Path(__file__).parents[1] / "bimvox" / "__init__.py"
    done = run_to_end(python_module("json.tool", "--help"), 60.0)
    assert done is not None
    assert done.code == 0


@pytest.mark.slow
def test_a_worker_ends_with_its_parent_whatever_ends_it():
    with subprocess.Popen([sys.executable, "-c", PARENT, CHILD], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        time.sleep(3.0)
        os.kill(child, 0)  # the process exists
        parent.kill()
    for _ in range(100):
        if not _runs(child):
            return
        time.sleep(0.1)
    raise AssertionError("the child goes on")


def _runs(pid: int) -> bool:
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False).stdout
    return bool(state.strip()) and not state.strip().startswith("Z")


def test_the_processors_are_those_that_this_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3}, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    assert processors() == 1
    monkeypatch.delattr(os, "sched_getaffinity")
    assert processors() == 64


def test_nothing_else_counts_processors():
    folders = (Path(processors.__code__.co_filename).parent, Path(__file__).parents[1] / "pipeline")
    sources = [path for folder in folders for path in folder.rglob("*.py")]
    assert [path.name for path in sources if "cpu_count" in path.read_text()] == ["processes.py"]
