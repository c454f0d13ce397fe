"""Measures one size: `bimvox plan` in a separate process, with an empty policy store and compiled kernels."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.scale.building import write_site

_PLAN = "import sys; from bimvox_cli.main import run; sys.exit(run())"

STAGES = {
    "read": ("open", "geometry", "elements"),
    "site": ("site", "voxelize"),
    "order": ("contacts", "order"),
    "policy": ("lessons", "train"),
    "plan": ("plan", "lifts"),
    "prove": ("prove",),
    "time": ("time",),
    "write": ("write",),
}
"""Groups of the stages that `bimvox plan` reports."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One size.

    Attributes:
        components: Components of the building.
        planned: Lifts planned.
        proven: Whether every planned lift is proven.
        wall_s: From the start of the process to its end.
        cpu_s: Processor time, including its child processes.
        memory_mb: Largest resident set, 10^6 bytes.
        log_mb: The log, 10^6 bytes.
        seconds: Wall time by stage.
    """

    components: int
    planned: int
    proven: bool
    wall_s: float
    cpu_s: float
    memory_mb: float
    log_mb: float
    seconds: dict[str, float]

    def as_json(self) -> dict[str, Any]:
        """Return it for the data file."""
        return asdict(self)


def measure(components: int, folder: Path, policy: str | None) -> Measured:
    """Plan a building with the whole command and return the measurement.

    Args:
        components: Number of components.
        folder: Scratch folder.
        policy: Id for ``--policy``; None for the command's default.

    Raises:
        RuntimeError: If the command fails.
    """
    site, log, out = write_site(folder, components), folder / "plan.mcap", folder / "plan.json"
    arguments = [sys.executable, "-c", _PLAN, "plan", str(site), "-o", str(log), "--json", "--quiet"]
    arguments += ["--policy", policy] if policy else []
    one = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    environment = os.environ | one | {"BIMVOX_POLICIES": str(folder / f"policies-{components}")}
    started_s = time.perf_counter()
    with out.open("wb") as stream:
        process = subprocess.Popen(arguments, stdout=stream, env=environment)
        _, status, used = os.wait4(process.pid, 0)
    wall_s = time.perf_counter() - started_s
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise RuntimeError(f"bimvox plan of {components} components ended with {process.returncode}")
    document = json.loads(out.read_bytes())
    if "lifts" not in document:
        raise RuntimeError(f"bimvox plan of {components} components: {document['error']['message']}")
    seconds = document["seconds"]
    stages = {name: sum(seconds.get(part, 0.0) for part in parts) for name, parts in STAGES.items()}
    stages["train"] = sum(value for name, value in seconds.items() if not any(name in p for p in STAGES.values()))
    unit = 1 if sys.platform == "darwin" else 1024
    return Measured(
        components,
        sum(lift["status"] == "planned" for lift in document["lifts"]),
        bool(document["verified"]),
        wall_s,
        used.ru_utime + used.ru_stime,
        used.ru_maxrss * unit / 1e6,
        log.stat().st_size / 1e6,
        {name: round(value, 3) for name, value in stages.items() if value or name not in ("policy", "train")},
    )
