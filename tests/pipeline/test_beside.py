"""Work on another core gives what it gives here, whatever becomes of the copy that does it."""

from __future__ import annotations

import os
import signal
import time

import pytest

from bimvox.errors import VerificationError
from pipeline.beside import Beside, can_copy


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
