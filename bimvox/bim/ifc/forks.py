"""The server of the geometry workers where processes can be forked: Linux and macOS.

It forks a worker for every socket that it receives: a worker starts in milliseconds however large the file is, and
shares the memory of the server, which never meshes anything. If its parent ends, it ends itself and its workers.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle
from pathlib import Path

from bimvox.bim.ifc.answer import READY, Mesher, Selector, answer_requests, no_selector

assert sys.platform != "win32"

_SHAPE_BYTES = 4 << 30
"""Memory that a worker may allocate in addition to the file."""


def leave_no_core_file() -> None:
    """From now on, a crash of this process or of a worker writes no core file."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def serve(control: Connection, mesher: Mesher, selector: Selector = no_selector) -> None:
    """Fork workers until the parent closes the control socket.

    There are two requests. ``"fork"``, followed by a socket for the worker, returns the worker's process id. The
    process id of a worker ends that worker and returns its exit status (negative: the signal that killed it).
    """
    workers: set[int] = set()
    try:
        control.send(READY)
        while True:
            request = control.recv()
            if request == "fork":
                channel = recv_handle(control)
                pid = os.fork()
                if pid == 0:
                    control.close()
                    _work(Connection(channel), mesher, selector)
                os.close(channel)
                workers.add(pid)
                control.send(pid)
            else:
                workers.remove(request)
                os.kill(request, signal.SIGKILL)
                control.send(os.waitstatus_to_exitcode(os.waitpid(request, 0)[1]))
    except (EOFError, OSError):
        for pid in workers:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _work(channel: Connection, mesher: Mesher, selector: Selector) -> None:
    """Answer requests until the parent closes the socket; never returns."""
    status = 1
    _limit_memory()
    try:
        answer_requests(channel, mesher, selector)
        status = 0
    finally:
        os._exit(status)


def _limit_memory() -> None:
    """Limit the memory, so that a kernel that keeps allocating fails before the machine runs out."""
    try:
        in_use = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    except OSError:
        return  # not Linux, where such a limit would do nothing
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = in_use + _SHAPE_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
