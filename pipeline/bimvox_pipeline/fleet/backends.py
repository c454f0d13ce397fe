"""The backends that execute the runs of a fleet: joblib is the only facade; this opens what is behind it."""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any, Literal

from bimvox.errors import InputError

Backend = Literal["loky", "ray", "dask"]

_RESTARTED = {"max_restarts": -1, "max_task_retries": 2}
"""Of the workers of Ray: one that dies is started again, and its run too; Dask does the same by itself."""


@contextmanager
def opened(backend: Backend, jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    """Open a backend and close it at the end.

    Args:
        backend: ``loky`` for processes on this machine; ``ray`` or ``dask`` for a cluster.
        jobs: Number of runs in parallel.
        address: Address of a running cluster; None starts one on this machine.

    Yields:
        The arguments for ``joblib.parallel_config``.

    Raises:
        InputError: If the backend is not installed, or its cluster cannot be reached.
    """
    with {"loky": _loky, "ray": _ray, "dask": _dask}[backend](jobs, address) as config:
        yield config


def worker_lost(backend: Backend, error: BaseException) -> bool:
    """Return whether an error of a backend says that a worker died."""
    if backend == "loky":
        from joblib.externals.loky.process_executor import BrokenProcessPool

        return isinstance(error, BrokenProcessPool)
    if backend == "ray":
        from ray.exceptions import RayError

        return isinstance(error, RayError)
    from distributed import KilledWorker

    return isinstance(error, KilledWorker)


@contextmanager
def _loky(jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    if address is not None:
        raise InputError("processes of this machine have no --cluster", hint="add --backend ray or --backend dask")
    start_workers("loky", jobs)
    yield {"backend": "loky", "n_jobs": jobs}


def start_workers(backend: Backend, jobs: int) -> None:
    """Start the workers of an open backend, also after a lost one ended them all; clusters start their own."""
    from joblib import Parallel, delayed, parallel_config

    if backend == "loky":
        with _interrupts_held_back(), parallel_config(backend="loky", n_jobs=jobs):
            Parallel()(delayed(os.getpid)() for _ in range(jobs))  # joblib keeps the workers


@contextmanager
def _ray(jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    try:
        import ray
        from ray.util.joblib import register_ray
    except ImportError as error:
        raise _not_installed("ray", error) from error
    own: dict[str, Any] = {"include_dashboard": False} if address is None else {"address": address}
    if address is None:
        own["num_cpus"] = jobs
    try:
        ray.init(
            **own,
            log_to_driver=False,
            logging_level=logging.ERROR,
            configure_logging=True,
        )
    except Exception as error:
        raise _not_reached("ray", address, error) from error
    try:
        register_ray()
        yield {"backend": "ray", "n_jobs": jobs, "ray_remote_args": _RESTARTED}
    finally:
        ray.shutdown()


@contextmanager
def _dask(jobs: int, address: str | None) -> Iterator[dict[str, Any]]:
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise _not_installed("dask", error) from error
    with dask.config.set({"distributed.logging.distributed": "critical"}):
        if address is not None:
            try:
                client = Client(address, timeout=20)
            except (OSError, ValueError, TimeoutError) as error:
                raise _not_reached("dask", address, error) from error
            with client:
                yield {"backend": "dask", "n_jobs": jobs}
            return
        with _interrupts_held_back():
            cluster = LocalCluster(
                n_workers=jobs,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
        with cluster, Client(cluster):
            yield {"backend": "dask", "n_jobs": jobs}


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Shield processes and threads started meanwhile from Ctrl-C, which a terminal sends to all of them.

    The command receives it, at the end of this context at the latest, and ends them.
    """
    if sys.platform == "win32":  # without masks of signals: a worker may print that it was interrupted
        yield
    else:
        resource_tracker.ensure_running()  # a later start would enable interrupts again
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _not_installed(backend: str, error: ImportError) -> InputError:
    return InputError(f"--backend {backend} is not installed ({error})", hint=f'pip install "bimvox[{backend}]"')


def _not_reached(backend: str, address: str | None, error: BaseException) -> InputError:
    where = f"the cluster at {address}" if address else "a cluster on this machine"
    first = (str(error).splitlines() or [type(error).__name__])[0]
    return InputError(f"--backend {backend}: {where} cannot be used: {first}", hint="check --cluster")
