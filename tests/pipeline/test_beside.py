"""Work on another core gives what it gives here, whatever becomes of the copy that does it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from bimvox.errors import VerificationError
from pipeline.beside import Beside, can_copy

ORPHAN = """
import time
from pipeline.beside import Beside
begun = Beside()(lambda: time.sleep(600.0))
print(begun._pid, flush=True)
time.sleep(600.0)
"""


def test_the_result_is_that_of_the_work_and_this_process_can_go_on_meanwhile():
    beside = Beside()
    here = os.getpid()
    result = beside(lambda: (os.getpid(), list(range(200_000))))
    done_here = sum(range(1000))
    where, numbers = result()
    assert done_here == 499_500
    assert numbers == list(range(200_000))
    assert (where != here) is can_copy()


def test_what_goes_wrong_is_told_here():
    def fails():
        raise VerificationError("not proven", failures=("lift 3",))

    with pytest.raises(VerificationError, match="not proven"):
        Beside()(fails)()


def test_a_copy_that_is_killed_or_never_answers_is_made_up_for_here():
    here = os.getpid()

    def dies():
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return "done"

    def hangs():
        if os.getpid() != here:
            time.sleep(600.0)
        return "done"

    assert Beside()(dies)() == "done"
    assert Beside(limit_s=0.2)(hangs)() == "done"


def test_a_copy_that_waits_for_a_lock_that_nobody_opens_is_given_up_long_before_the_limit():
    """A thread that held it was not copied. Without looking at what the copy does this would take ten minutes."""
    here = os.getpid()
    lock, held, done = threading.Lock(), threading.Event(), threading.Event()

    def hold():
        with lock:
            held.set()
            done.wait()

    def works():
        if os.getpid() != here:
            lock.acquire()
        return "done"

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait()
    try:
        assert Beside(limit_s=600.0)(works)() == "done"
    finally:
        done.set()
        thread.join()


def test_a_copy_that_is_at_work_is_waited_for(monkeypatch):
    monkeypatch.setattr("pipeline.beside._STUCK_S", 0.1)
    here = os.getpid()

    def works():
        until_s = time.process_time() + 1.0
        while time.process_time() < until_s:
            pass
        return os.getpid()

    assert (Beside()(works)() != here) is can_copy()


@pytest.mark.skipif(not can_copy(), reason="no copies here")
def test_a_copy_does_not_outlive_a_process_that_is_killed():
    """It would hold the port that viewers are served on, and memory."""
    child = subprocess.Popen([sys.executable, "-c", ORPHAN], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    copy = int(child.stdout.readline())
    child.kill()
    child.wait()
    until_s = time.monotonic() + 20.0
    while runs(copy):
        assert time.monotonic() < until_s
        time.sleep(0.05)


def runs(pid: int) -> bool:
    """Whether there is such a process; one that has ended and that nobody has asked for does not count."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in ("Z", "X")
    except OSError:
        return False


def test_work_that_is_not_asked_for_leaves_no_process_behind():
    beside = Beside()
    begun = [beside(lambda: time.sleep(600.0)) for _ in range(2)]
    copies = [one._pid for one in begun]
    assert all(copies) == can_copy()
    beside.close()
    assert not any(one.goes_on for one in begun)
    for copy in filter(None, copies):
        with pytest.raises(ProcessLookupError):
            os.kill(copy, 0)


def test_on_one_core_the_work_is_done_here(monkeypatch):
    monkeypatch.setattr("pipeline.beside.can_copy", lambda: False)
    assert Beside()(os.getpid)() == os.getpid()
