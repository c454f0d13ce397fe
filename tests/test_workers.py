"""Workers share tasks: the same results, whatever happens to them."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import threading
import time
import weakref

import numpy as np
import pytest

import bimvox.workers as module
from bimvox.errors import FileError, MotionError, NoPlanError
from bimvox.workers import ALONE, Workers, in_chunks


class Base:
    """A value that is sent once."""

    def __init__(self, numbers):
        self.numbers = numbers

    def total(self, factor):
        return factor * int(self.numbers.sum()), os.getpid()

    def is_writable(self):
        return self.numbers.flags.writeable

    def same(self, other):
        return other is self


def asked(base):
    return base.numbers(), os.getpid()


def itself(value):
    return value


def slow_square(number):
    time.sleep(0.01)
    return number * number, os.getpid()


def wait_for_file(path):
    while not path.exists():
        time.sleep(0.01)
    return os.getpid()


def fail_elsewhere(parent):
    if os.getpid() != parent:
        raise NoPlanError("not here")
    time.sleep(0.05)
    return "done"


def die_elsewhere(parent):
    if os.getpid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return "done"


def fail(number):
    raise MotionError("beam-7", f"{number} is too fast")


@pytest.fixture
def two():
    workers = Workers(2, (slow_square,))
    yield workers
    workers.close()


def wait_for_a_worker(workers):
    for _ in range(200):
        if len({pid for _, pid in workers.run(slow_square, [(n,) for n in range(10)])}) >= 2:
            return
    pytest.fail("no worker has started")


def test_results_are_in_the_order_of_the_tasks_and_both_processes_make_them(two):
    wait_for_a_worker(two)
    found = two.run(slow_square, [(n,) for n in range(40)])
    assert [square for square, _ in found] == [n * n for n in range(40)]
    assert len({pid for _, pid in found}) == 2
    assert os.getpid() in {pid for _, pid in found}


def test_known_values_keep_their_identity_and_their_arrays_stay_read_only(two):
    wait_for_a_worker(two)
    fixed = np.arange(6)
    fixed.flags.writeable = False
    base, free = Base(fixed), Base(np.arange(6))
    with two.knowing(base, free):
        assert [total for total, _ in two.run(Base.total, [(base, n) for n in range(20)])] == [
            15 * n for n in range(20)
        ]
        assert all(two.run(Base.same, [(base, base)] * 20))
        assert all(one is base for one in two.run(itself, [(base,)] * 20))
        assert not any(two.run(Base.is_writable, [(base,)] * 20))
        assert all(two.run(Base.is_writable, [(free,)] * 20))
        with two.knowing(other := Base(np.ones(3))):
            assert not any(two.run(Base.same, [(base, other)] * 20))
    with two.knowing(other):
        assert {total for total, _ in two.run(Base.total, [(other, 2)] * 20)} == {6}
    assert two.count == 2


def test_each_result_comes_in_turn_and_only_a_few_are_made_ahead(two):
    wait_for_a_worker(two)
    taken = []

    def tasks():
        for n in range(40):
            taken.append(n)
            yield (n,)

    found, pids = [], set()
    for square, pid in two.each(slow_square, tasks()):
        found.append(square)
        pids.add(pid)
        assert len(taken) <= len(found) + module._AHEAD
    assert found == [n * n for n in range(40)]
    assert len(pids) == 2
    assert list(two.each(slow_square, [])) == []


def test_what_is_done_here_while_a_worker_is_busy_is_not_kept_for_it(two, tmp_path):
    wait_for_a_worker(two)
    busy = two.begin(wait_for_file, [(tmp_path / "go",)])
    while busy._work._waiting:
        time.sleep(0.01)
    ((made,),) = two.run(list, [([Base(np.zeros(3))],)])
    kept = weakref.ref(made)
    del made
    gc.collect()
    assert kept() is None
    (tmp_path / "go").touch()
    (pid,) = busy.finished()
    assert pid != os.getpid()


def test_each_task_that_a_worker_fails_is_done_here(two):
    wait_for_a_worker(two)
    assert list(two.each(die_elsewhere, [(os.getpid(),)] * 12)) == ["done"] * 12
    assert [square for square, _ in ALONE.each(slow_square, [(2,), (3,)])] == [4, 9]
    with pytest.raises(MotionError, match="beam-7: 0 is too fast"):
        list(two.each(fail, [(n,) for n in range(4)]))


@pytest.mark.parametrize("task", [fail_elsewhere, die_elsewhere])
def test_what_a_worker_fails_is_done_here(two, task):
    wait_for_a_worker(two)
    assert two.run(task, [(os.getpid(),)] * 30) == ["done"] * 30
    for _ in range(100):
        if two.count == 1:
            break
        time.sleep(0.02)
    assert two.count == 1
    assert [square for square, _ in two.run(slow_square, [(n,) for n in range(5)])] == [0, 1, 4, 9, 16]


def test_an_error_is_raised_as_without_workers(two):
    with pytest.raises(MotionError, match="beam-7: 0 is too fast"):
        two.run(fail, [(n,) for n in range(4)])


def test_nothing_of_closed_workers_stays():
    def threads():
        return sum(thread.name == "worker" for thread in threading.enumerate())

    before = threads()
    base = Base(np.arange(9))
    alive = weakref.ref(base)
    workers = Workers(3, (slow_square,))
    wait_for_a_worker(workers)
    workers.run(Base.total, [(base, n) for n in range(9)])
    workers.close()
    del base, workers
    for _ in range(600):
        gc.collect()
        if threads() <= before and alive() is None:
            break
        time.sleep(0.05)
    assert threads() <= before
    assert alive() is None


def test_with_fewer_processes_than_wished_the_work_is_done(monkeypatch):
    real, started = module.start_connected, []

    def refused(*given):
        if started:
            raise OSError("too many open files")
        started.append(given)
        return real(*given)

    monkeypatch.setattr(module, "start_connected", refused)
    workers = Workers(4, (slow_square,))
    assert workers.count == 2
    assert [square for square, _ in workers.run(slow_square, [(n,) for n in range(5)])] == [0, 1, 4, 9, 16]
    workers.close()


def test_what_cannot_be_sent_is_done_here(two):
    wait_for_a_worker(two)
    own = Base(lambda: 7)
    with two.knowing(own):
        assert two.run(asked, [(own,)] * 6) == [(7, os.getpid())] * 6
    assert two.count == 2


def test_without_workers_tasks_are_done_here():
    with ALONE.knowing("anything"):
        assert {pid for _, pid in ALONE.run(slow_square, [(1,), (2,)])} == {os.getpid()}
    assert ALONE.count == 1


def test_chunks_keep_all_items_in_order():
    for count in (0, 1, 7, 100, 1000):
        chunks = in_chunks(range(count), 2)
        assert [item for chunk in chunks for item in chunk] == list(range(count))
        assert all(1 <= len(chunk) <= 16 for chunk in chunks)


def test_errors_keep_their_evidence_on_the_way():
    errors = [MotionError("beam-7", "too fast", hint="slower"), FileError("a.ifc", "is empty")]
    errors.append(NoPlanError("no lift can be planned", reasons={"a": "b"}))
    for error in errors:
        again = pickle.loads(pickle.dumps(error))
        assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))
