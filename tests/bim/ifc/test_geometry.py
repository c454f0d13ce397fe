"""Workers: a hang, a crash or a failure of the kernel costs one shape, not the file; workers end with their parent."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from warm_worker import start_warm

from bimvox.bim.ifc.geometry import FAST_LIBRARY, GeometryPool
from bimvox.errors import IfcError
from bimvox.processes import start_connected

_SERVER = f"""
import os, signal, sys, time
import numpy as np
from multiprocessing.connection import Connection
from bimvox.bim.ifc.answer import clean_shape
from bimvox.bim.ifc.forks import serve

def mesh(step_ids, library):
    step_id, fast = step_ids[0], library == "{FAST_LIBRARY}"
    while step_id == 1 or (step_id == 2 and fast):
        pass
    if step_id in (1011, 1012):
        time.sleep(60 if step_id == 1011 else 0.5)
    if step_id == 3 or (step_id == 4 and fast):
        os.kill(os.getpid(), signal.SIGSEGV)
    if step_id == 5:
        return "no geometry"
    if step_id == 6:
        os._exit(3)
    if step_id == 9:
        return str(len(bytearray(40 << 30)))
    if step_id == 7 and fast:
        return clean_shape(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    shape = clean_shape(np.eye(3) * (step_id + 1), np.array([[0, 1, 2]], dtype=np.int32))
    return shape, [np.eye(4) * member for member in step_ids]

serve(Connection(int(sys.argv[1])), mesh)
"""


def pool(script: str, timeout_s: float = 0.7, processes: int = 1) -> GeometryPool:
    return GeometryPool(Path("a.ifc"), timeout_s=timeout_s, processes=processes, command=[sys.executable, "-c", script])


def test_the_limit_is_processor_time_so_a_busy_machine_loses_no_part() -> None:
    with pool(_SERVER, timeout_s=0.3) as workers:
        meshed = workers.mesh([(1012,), (1,)])
    assert sorted(meshed.shapes) == [1012], "it took longer than its limit only because it did not run"
    assert not meshed.retried
    assert "within 0.3 s of processor time" in meshed.failures[1]


def test_time_is_counted_for_each_shape_anew() -> None:
    busy = _SERVER.replace(
        "def mesh(step_ids, library):",
        """def mesh(step_ids, library):
    until = time.process_time() + 0.1
    while time.process_time() < until:
        pass""",
    )
    with pool(busy, timeout_s=0.6) as workers:
        meshed = workers.mesh([(step_id,) for step_id in range(20, 30)])
    assert len(meshed.shapes) == 10
    assert not meshed.retried


def test_a_worker_that_sleeps_for_ever_is_ended_too() -> None:
    with pool(_SERVER, timeout_s=0.03) as workers:
        meshed = workers.mesh([(1011,), (10,)])
    assert "no result" in meshed.failures[1011]
    assert sorted(meshed.shapes) == [10]


@pytest.mark.parametrize(
    "processes", [pytest.param(1, marks=pytest.mark.slow), 2, pytest.param(3, marks=pytest.mark.slow)]
)
def test_everything_else_survives(processes: int) -> None:
    done: list[int] = []
    work: list[int] = []
    ids = [*range(9), *range(10, 200)]
    groups = [(step_id,) for step_id in ids[:100]] + [tuple(ids[100:150]), tuple(ids[150:])]
    with pool(_SERVER, processes=processes) as workers:
        meshed = workers.mesh(groups, done.append, meanwhile=map(work.append, range(5)))
    assert sorted([*meshed.shapes, *meshed.failures]) == ids
    assert sorted(meshed.failures) == [1, 3, 5, 6]
    assert "within 0.7 s of processor time" in meshed.failures[1]
    assert "signal 11" in meshed.failures[3]
    assert meshed.failures[5] == "no geometry"
    assert "exit status 3" in meshed.failures[6]
    assert meshed.retried == (2, 4, 7)
    assert done == sorted(done)
    assert done[-1] == len(ids)
    assert work == list(range(5))
    for step_id, placed in meshed.shapes.items():
        assert placed.shape.mesh.vertices_m.max() == next(group[0] for group in groups if step_id in group) + 1
        assert placed.placement[0, 0] == step_id


def test_a_kernel_that_takes_all_memory_is_stopped() -> None:
    with pool(_SERVER) as workers:
        meshed = workers.mesh([(9,), (10,)])
    assert "crashed" in meshed.failures[9]
    assert sorted(meshed.shapes) == [10]


def test_the_plain_library_may_come_first() -> None:
    with pool(_SERVER) as workers:
        meshed = workers.mesh([(2,), (4,), (7,), (5,)], plain={2, 4, 5})
    assert sorted(meshed.shapes) == [2, 4, 7]
    assert meshed.retried == (7,)
    assert meshed.failures == {5: "no geometry"}


def test_a_group_that_fails_fails_as_a_whole() -> None:
    with pool(_SERVER) as workers:
        meshed = workers.mesh([(5, 50, 51), (8, 9)])
    assert meshed.failures == dict.fromkeys((5, 50, 51), "no geometry")
    assert sorted(meshed.shapes) == [8, 9]


def test_a_server_that_cannot_start_is_an_error_with_its_last_words() -> None:
    with pool("raise SystemExit('numpy is broken')") as workers, pytest.raises(IfcError, match="numpy is broken"):
        workers.mesh([(7,)])


def test_no_products_no_wait() -> None:
    started_s = time.monotonic()
    with pool("import time; time.sleep(60)") as workers:
        assert workers.mesh([]).shapes == {}
    assert time.monotonic() - started_s < 30


_CALLER = """
import sys
from pathlib import Path
from bimvox.bim.ifc.geometry import GeometryPool

with GeometryPool(Path("a.ifc"), timeout_s=60.0, command=[sys.executable, "-c", sys.argv[1]]) as workers:
    worker = workers._server.new_worker()
    worker.give(((1011,), "opencascade"), 60.0)
    print(workers._server.pid, worker.pid, flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_if_the_caller_dies_a_hung_worker_ends_too(number: signal.Signals) -> None:
    caller = subprocess.Popen(
        [sys.executable, "-c", _CALLER, _SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert caller.stdout is not None
    pids = [int(word) for word in caller.stdout.readline().split()]
    assert len(pids) == 2
    caller.send_signal(number)
    caller.communicate()
    patience_s = time.monotonic() + 30.0
    while any(map(_runs, pids)) and time.monotonic() < patience_s:
        time.sleep(0.02)
    assert not any(map(_runs, pids))


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        # A zombie that is not reaped yet is not a running process.
        return "zombie" not in Path(f"/proc/{pid}/status").read_text() if Path("/proc/self").exists() else True
    except (ProcessLookupError, FileNotFoundError):
        return False


def test_what_the_workers_return_is_the_same_however_many_and_however_started(
    frame_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import ifcopenshell

    file = ifcopenshell.open(frame_file)
    groups = [(product.id(),) for product in file.by_type("IfcElement")]
    found = []
    for processes, start in ((1, start_connected), (2, start_connected), (1, start_warm)):
        monkeypatch.setattr("bimvox.bim.ifc.geometry.start_connected", start)
        with GeometryPool(frame_file, timeout_s=60.0, processes=processes) as workers:
            found.append(workers.mesh(groups))
    assert not found[0].failures
    for step_id, one in found[0].shapes.items():
        for other in (again.shapes[step_id] for again in found[1:]):
            assert np.array_equal(one.shape.mesh.vertices_m, other.shape.mesh.vertices_m)
            assert np.array_equal(one.shape.mesh.faces, other.shape.mesh.faces)
            assert np.array_equal(one.placement, other.placement)
