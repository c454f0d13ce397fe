"""The workers: hangs, crashes and failures of the kernel cost one product, not the file."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from bimvox.bim.ifc_geometry import FAST_LIBRARY, GeometryPool, ProductShape
from bimvox.errors import IfcError

_WORKER = f"""
import os, signal, time
import numpy as np
from multiprocessing.connection import Connection
answers, requests = Connection(os.dup(1), readable=False), Connection(os.dup(0), writable=False)
answers.send("ready")
while True:
    try:
        step_id, library = requests.recv()
    except EOFError:
        break
    fast = library == "{FAST_LIBRARY}"
    if step_id == 1 or (step_id == 2 and fast):
        time.sleep(60)
    if step_id == 3 or (step_id == 4 and fast):
        os.kill(os.getpid(), signal.SIGSEGV)
    if step_id == 5:
        answers.send("no geometry")
        continue
    answers.send((np.full((3, 3), float(step_id)), np.array([[0, 1, 2]], dtype=np.int32), np.eye(4)))
"""


def pool(script: str, timeout_s: float = 0.7, processes: int = 1) -> GeometryPool:
    return GeometryPool(Path("a.ifc"), timeout_s=timeout_s, processes=processes, command=[sys.executable, "-c", script])


@pytest.mark.parametrize("processes", [1, 2])
def test_everything_else_survives(processes: int) -> None:
    done: list[int] = []
    ids = list(range(200))
    with pool(_WORKER, processes=processes) as workers:
        meshed = workers.mesh(ids, done.append)
    assert sorted([*meshed.shapes, *meshed.failures]) == ids
    assert sorted(meshed.failures) == [1, 3, 5]
    assert "within 0.7 s" in meshed.failures[1]
    assert "signal 11" in meshed.failures[3]
    assert meshed.failures[5] == "no geometry"
    assert meshed.retried == (2, 4)
    assert done[-1] == len(done) == len(ids)
    assert all((shape.vertices_m == step_id).all() for step_id, shape in meshed.shapes.items())


def test_a_worker_that_cannot_start_is_an_error_with_its_last_words() -> None:
    with pool("raise SystemExit('numpy is broken')") as workers, pytest.raises(IfcError, match="numpy is broken"):
        workers.mesh([7])


def test_no_products_no_wait() -> None:
    with pool("import time; time.sleep(60)") as workers:
        assert workers.mesh([]).shapes == {}


def test_far_placements_keep_their_precision() -> None:
    vertices = np.random.default_rng(0).uniform(-5, 5, (50, 3))
    near, far = np.eye(4), np.eye(4)
    far[:3, 3] = origin = np.array([5_000_000.0, 450_000.0, 0.0])
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    a = ProductShape(vertices, faces, near).world_m(np.zeros(3))
    b = ProductShape(vertices, faces, far).world_m(origin)
    assert np.array_equal(a, b)
