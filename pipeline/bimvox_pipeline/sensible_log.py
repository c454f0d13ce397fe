"""Refuses a log whose values make no sense, before anything is drawn or exported from them."""

from __future__ import annotations

from pathlib import Path

from bimvox.errors import LogFileError
from bimvox.log.plan_log import PlanLog


def require_sense(log: PlanLog, file: Path, act: str = "shown") -> PlanLog:
    """Return a log whose values are finite and in range.

    Raises:
        LogFileError: If a value makes no sense: names the first, the file, and what cannot be done with it.
    """
    from bimvox.proof.values import check_values

    values = check_values(log.plan, log.motions, log.context)
    if not values.passed:
        raise LogFileError(
            file,
            f"its values make no sense, so it cannot be {act}: {values.failures[0]}",
            hint=f"bimvox verify {file} names them all",
        )
    return log
