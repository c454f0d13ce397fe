"""The work of the workers in tests of fleets, in its own module because they are other processes."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from bimvox_pipeline.fleet.runs import Run
from bimvox_pipeline.fleet.work import carry_out, failed, write_record


def kills_itself_where_asked(run: Run, folder: Path) -> None:
    if run.name.startswith("deadly"):
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    write_record(folder, failed(run, "tried", f"threads {os.environ['OMP_NUM_THREADS']}", None))


def plans_with_a_policy_from_scratch(run: Run, folder: Path) -> None:
    """Plan a run with a trained policy, not the shipped one, from a store next to the fleet's folder."""
    from bimvox.policy import choice as policy_choice
    from bimvox.policy import site_lessons

    os.environ["BIMVOX_POLICIES"] = str(folder / "policies")
    site_lessons._STARTS = 4  # a short test
    policy_choice._beginning = lambda start_from: (None, None)
    carry_out(run, folder)
