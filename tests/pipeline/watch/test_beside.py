"""Work that a copy does its share of comes to what it comes to here, whatever becomes of the copy."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import pytest
from bimvox_pipeline.watch.beside import Beside
from bimvox_pipeline.watch.copied import Copied, can_copy

ORPHAN = """
import time
from bimvox_pipeline.watch.copied import Copied
print(Copied(lambda link: time.sleep(600.0))._pid, flush=True)
time.sleep(600.0)
"""
copies = pytest.mark.skipif(not can_copy(), reason="no copies here")


def squares(side):
    """A side's share: the squares of the numbers that it claims, and who found them."""
    return {n: (n * n, os.getpid()) for n in iter(partial(side.claim, 0), None)}


def test_each_piece_is_done_once_by_one_of_the_two():
    beside, count = Beside(), 2_000
    side = beside.share((count,), lambda other: other.give(squares(other)))
    mine = squares(side)
    theirs = side.take() if len(mine) < count else {}
    assert not mine.keys() & theirs.keys()
    assert {n: square for n, (square, _) in (mine | theirs).items()} == {n: n * n for n in range(count)}
    assert {who for _, who in mine.values()} <= {os.getpid()}
    assert os.getpid() not in {who for _, who in theirs.values()}
    beside.close()


def test_kinds_of_pieces_are_claimed_apart():
    side = Beside().share((2, 1), lambda _: None)
    assert [side.claim(0), side.claim(1), side.claim(0), side.claim(0), side.claim(1)] == [0, 0, 1, None, None]


@copies
def test_both_may_give_more_than_a_pipe_holds_at_once():
    much = list(range(500_000))

    def work(other):
        other.give(much)
        other.give(len(other.take()))

    side = Beside().share((1,), work)
    side.give(much)
    assert side.take() == much
    assert side.take() == len(much)
    assert side.take() is None


@copies
@pytest.mark.parametrize("when", ["at once", "in the middle"])
def test_a_copy_that_dies_or_fails_gives_nothing_more(when):
    def dies(other):
        if when == "in the middle":
            other.give("half of it")
        os.kill(os.getpid(), signal.SIGKILL)

    def fails(_):
        raise ValueError("no")

    side = Beside().share((1,), dies)
    if when == "in the middle":
        assert side.take() == "half of it"
    assert side.take() is None
    side.give("what nobody has")
    assert Beside().share((1,), fails).take() is None


@copies
def test_a_copy_that_never_answers_is_given_up():
    def hangs(_):
        while True:
            pass

    beside = Beside(limit_s=0.2)
    assert beside.share((1,), hangs).take() is None
    beside.close()


@copies
def test_a_copy_that_waits_for_a_lock_that_nobody_opens_is_given_up_long_before_the_limit():
    """A thread that held it was not copied. Without looking at what the copy does this would take ten minutes."""
    lock, held, done = threading.Lock(), threading.Event(), threading.Event()

    def hold():
        with lock:
            held.set()
            done.wait()

    def works(other):
        lock.acquire()
        other.give("done")

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait()
    beside = Beside(limit_s=600.0)
    try:
        assert beside.share((1,), works).take() is None
    finally:
        done.set()
        thread.join()
        beside.close()


@copies
def test_a_copy_that_is_at_work_is_waited_for(monkeypatch):
    monkeypatch.setattr("bimvox_pipeline.watch.copied._STUCK_S", 0.1)

    def works(other):
        until_s = time.process_time() + 1.0
        while time.process_time() < until_s:
            pass
        other.give(os.getpid())

    assert Beside().share((1,), works).take() not in (None, os.getpid())


@copies
def test_a_copy_that_is_told_to_end_as_it_is_made_does_not_go_on_as_this_process(monkeypatch):
    """Ctrl-C is for the whole group of processes: the copy must not run what ends the original."""
    fork = os.fork

    def forked() -> int:
        pid = fork()
        if pid == 0:
            os.kill(os.getpid(), signal.SIGINT)
        return pid

    monkeypatch.setattr(os, "fork", forked)
    here = os.getpid()
    copy = Copied(lambda link: link.give(os.getpid()))
    try:
        if os.getpid() != here:
            os._exit(3)
        assert copy.take() not in (None, here)
        copy.give_up()
    finally:
        if os.getpid() != here:
            os._exit(3)


@copies
def test_a_copy_that_is_given_up_twice_at_once_is_closed_once(monkeypatch):
    """As where Ctrl-C comes while it is given up: the watch gives it up once more as it ends."""
    copy = Copied(lambda _: time.sleep(600.0))
    waitpid = os.waitpid

    def interrupted(pid: int, options: int) -> tuple[int, int]:
        waitpid(pid, options)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "waitpid", interrupted)
        with pytest.raises(KeyboardInterrupt):
            copy.give_up()
    copy.give_up()
    assert not copy.goes_on


@copies
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


@copies
def test_work_that_is_not_asked_for_leaves_no_process_and_no_file_behind():
    before = len(list(Path("/proc/self/fd").iterdir()))
    beside = Beside()
    sides = [beside.share((3, 3), lambda _: time.sleep(600.0)) for _ in range(2)]
    pids = [side._copy._pid for side in sides]
    assert all(pids)
    beside.close()
    assert not any(side.goes_on for side in sides)
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_where_no_copy_can_be_made_all_is_done_here(monkeypatch):
    def none_left(*_):
        raise BlockingIOError("no process left")

    monkeypatch.setattr("os.fork", none_left)
    assert len(squares(Beside().share((5,), squares))) == 5
    monkeypatch.setattr("bimvox_pipeline.watch.beside.can_copy", lambda: False)
    side = Beside().share((5,), squares)
    assert len(squares(side)) == 5
    assert side.take() is None
    with pytest.raises(OSError, match="no process left"):
        Copied(squares)
