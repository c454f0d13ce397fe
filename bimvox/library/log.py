"""Plans written to MCAP logs and read back."""

from __future__ import annotations

from pathlib import Path

from bimvox.errors import InputError
from bimvox.files import write_atomically
from bimvox.library.arguments import insist, path_of
from bimvox.library.plan_value import Plan
from bimvox.log.plan_log import PlanLog, with_full_rate
from bimvox.log.reader import read_log as read_record
from bimvox.log.recorder import write_log as write_record
from bimvox.workers import ALONE, Workers


def write_log(plan: Plan, path: Path | str, *, full_rate: bool = False) -> Path:
    """Write a plan as an MCAP log, whole or not at all, and return its path.

    Args:
        plan: The plan.
        path: The log, ``.mcap``; an existing file is replaced.
        full_rate: Whether viewers are shown every sample of the motions instead of those that a viewer needs. What is
            proven is the same: every log has the exact samples.

    Raises:
        InputError: If ``plan`` is not a plan, or the name does not end in ``.mcap``.
        FileError: If it cannot be written; ``path`` names it.
    """
    plan, path = insist("write_log", plan, Plan, "plan"), path_of("write_log", path)
    if path.suffix.lower() != ".mcap":
        raise InputError(f"{path}: a log is an MCAP file", hint=f"name it {path.with_suffix('.mcap').name}")
    write_log_file(path, with_full_rate(plan.record) if full_rate else plan.record)
    return path


def read_log(path: Path | str) -> Plan:
    """Return the plan of a log. It is not proven again, so its ``verdict`` is None: :func:`bimvox.verify` proves it.

    Args:
        path: A log of bimvox.

    Raises:
        LogFileError: If it is missing, damaged, or not a log of bimvox.
    """
    return Plan(read_record(path_of("read_log", path, "a log")))


def write_log_file(path: Path, record: PlanLog, workers: Workers = ALONE) -> None:
    """Write a log, whole or not at all; workers share the work."""
    write_atomically(path, lambda stream: write_record(stream, record, workers=workers))
