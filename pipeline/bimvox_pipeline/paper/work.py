"""One job in its process: from the files of the results that it needs to the file of its own."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.files import write_atomically
from bimvox.paper.experiment.jobs import Job
from bimvox_pipeline.paper.folder import read_json, result_file, weights_file, write_json

if TYPE_CHECKING:
    from bimvox.paper.experiment.work import JobResult
    from bimvox.paper.policy.network import ValueNetwork


def do_job(job: Job, folder: Path) -> None:
    """Do a job whose needs are in the folder, and write its result there."""
    from bimvox.paper.experiment.work import result_of
    from bimvox.paper.policy.network import network_to_bytes

    checkpoint = folder / f"{job.name}.checkpoint.safetensors"

    def keep(network: ValueNetwork) -> None:
        write_atomically(checkpoint, network_to_bytes(network))

    wall, cpu = time.perf_counter(), time.process_time()
    result = result_of(job, {role: _read(folder, name) for role, name in job.needs.items()}, keep)
    if result.network is not None:
        write_atomically(weights_file(folder, job.name), network_to_bytes(result.network))
    checkpoint.unlink(missing_ok=True)
    document = {
        "part": job.part,
        "mode": job.mode,
        "seed": job.seed,
        **result.document,
        "seconds": round(time.perf_counter() - wall, 3),
        "cpu_seconds": round(time.process_time() - cpu, 3),
    }
    write_json(result_file(folder, job.name), document)


def _read(folder: Path, name: str) -> JobResult:
    from bimvox.paper.experiment.work import JobResult
    from bimvox.paper.policy.network import network_from_bytes

    weights = weights_file(folder, name)
    network = network_from_bytes(weights.read_bytes()) if weights.exists() else None
    return JobResult(read_json(result_file(folder, name)), network)
