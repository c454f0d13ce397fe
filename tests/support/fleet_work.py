"""The work of the workers in tests of fleets, in its own module because they are other processes."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.fleet.runs import Run, Work, carry_out, failed, planned


def carry_out_in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let fleets execute their runs in this process, one after the other: starting a process takes seconds."""

    def carried_out(work: Work, run: Run, folder: Path) -> bool:
        carry_out(work, run, folder)
        return True

    monkeypatch.setattr("bimvox_pipeline.fleet.schedule._carry_out_apart", carried_out)


def plans_with_a_policy_from_scratch(run: Run, folder: Path) -> dict[str, Any]:
    """Plan a run with a trained policy, not the shipped one, from a store next to the fleet's folder."""
    from bimvox.policy import choice as policy_choice
    from bimvox.policy import site_lessons

    os.environ["BIMVOX_POLICIES"] = str(folder / "policies")
    site_lessons._STARTS = 4  # a short test
    policy_choice._beginning = lambda start_from: (None, None)
    return planned(run, folder)


def dies_as_named(run: Run, folder: Path) -> dict[str, Any]:
    """Kill this process or its worker, once or always, as the name of the run says; otherwise record the run."""
    _die(run.name, folder)
    time.sleep(0.05)
    return failed(run, "tried", f"threads {os.environ['OMP_NUM_THREADS']}", None)


def dies_once_and_plans(run: Run, folder: Path) -> dict[str, Any]:
    """Plan a run; at first, its process dies, or its worker if it has obstructions."""
    _die(f"{'worker' if run.wish.obstructions else 'process'}-once-{run.name}", folder)
    return planned(run, folder)


def _die(name: str, folder: Path) -> None:
    victim, _, often = name.partition("-")
    died = folder.parent / f"{name}.died"
    if victim in ("process", "worker") and (often.startswith("always") or not died.exists()):
        died.touch()
        os.kill(os.getpid() if victim == "process" else os.getppid(), signal.SIGKILL)
        time.sleep(60.0)  # this process ends with its worker
