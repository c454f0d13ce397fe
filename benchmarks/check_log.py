"""Checks a log with third-party readers, each in a separate process.

``make check-log`` (``LOG=file`` for your own; otherwise the sample frame is planned, by search alone). ``pymcap-cli
doctor`` checks the container, ``rerun mcap check`` the channels as the viewer Rerun reads them; MPXJ reads the schedule
as Microsoft Project XML, and writes it for Primavera, which bimvox reads as a programme. Readers that are not installed
are named and skipped. If one finds a problem, the exit code is 1.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from datetime import datetime, timedelta
from pathlib import Path

SAMPLE = Path(__file__).parents[1] / "sample_models" / "frame.ifc"
READER = Path(__file__).parent / "read_ms_project.py"
START = "2026-12-01T07:00"
CHECKERS = (("pymcap-cli", "doctor"), ("rerun", "mcap", "check"))


def sample_log(folder: Path) -> Path:
    """Return the log of the sample frame, planned into a folder."""
    from bimvox_pipeline.plan import plan
    from bimvox_pipeline.site import init

    from bimvox.library.arguments import PolicyWish
    from bimvox.progress import SilentProgress

    site, log = folder / "frame.site.toml", folder / "frame.mcap"
    init(SAMPLE, site, progress=SilentProgress())
    plan(site, log, wish=PolicyWish("none"), progress=SilentProgress())
    return log


def main() -> int:
    """Run every installed checker; return 1 if one finds a problem or none is installed."""
    tools, *given = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        log = Path(given[0]) if given else sample_log(Path(folder))
        codes = [_schedule_read(Path(tools) / "python", log, Path(folder))]
        for name, *arguments in CHECKERS:
            program = Path(tools) / name
            if not program.exists():
                print(f"not installed: {name}")
                continue
            print(f"{' '.join([name, *arguments])} {log.name}", flush=True)
            codes.append(subprocess.run([program, *arguments, log], check=False).returncode)
    codes = [code for code in codes if code is not None]
    print("found nothing" if codes and not any(codes) else "FAILED")
    return 0 if codes and not any(codes) else 1


def _schedule_read(python: Path, log: Path, folder: Path) -> int | None:
    """Return 0 if MPXJ reads the schedule of a log with its times, 1 if it does not, None if it is not installed."""
    from bimvox_pipeline.export import export

    from bimvox.exporters.lift_schedule import duration_text
    from bimvox.library.export import When
    from bimvox.log.plan_log import log_dates
    from bimvox.log.reader import read_log
    from bimvox.progress import SilentProgress
    from bimvox.site.programme import read_programme

    if subprocess.run([python, "-c", "import jpype, mpxj"], check=False, capture_output=True).returncode:
        print("not installed: mpxj and jpype1")
        return None
    print(f"mpxj {log.stem}.xml", flush=True)
    export(
        log,
        to="msproject",
        out=folder / "schedule.xml",
        when=When(datetime.fromisoformat(START)),
        progress=SilentProgress(),
    )
    record = read_log(log)
    dates = log_dates(record, datetime.fromisoformat(START))
    assert dates is not None
    xer = folder / "schedule.xer"
    read = subprocess.run([python, READER, folder / "schedule.xml", xer], check=False, capture_output=True, text=True)
    if read.returncode:
        print(read.stderr)
        return 1
    tasks = [task for task in json.loads(read.stdout) if not task["is_summary"]]  # lifts and deliveries
    for task in tasks:
        begins, ends = (datetime.fromisoformat(task[key]) for key in ("start", "finish"))
        at_ns, until_ns = ((one - dates.begins) // timedelta(microseconds=1) * 1000 for one in (begins, ends))
        worked = timedelta(microseconds=dates.work.between(at_ns, until_ns) // 1000)  # a break may fall into it
        if duration_text(worked) != duration_text(timedelta(seconds=round(task["duration_s"]))):
            print(f"{task['name']}: {task['duration_s']} s from {begins} to {ends}")
            return 1
    lifts = [task["text1"] for task in tasks if task["text1"] is not None]
    ours = sorted((one.name, f"{one.start:%FT%R}") for one in read_programme(xer.read_bytes(), xer.name, None).tasks)
    theirs = sorted((task["name"], task["start"][:16]) for task in tasks)
    if ours != theirs:
        print(f"{xer.name}: bimvox reads {ours}; MPXJ wrote {theirs}")
        return 1
    return int(lifts != [record.plan.site.components[lift.component].id for lift in record.planned])


if __name__ == "__main__":
    sys.exit(main())
