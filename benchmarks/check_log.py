"""Looks at a log with other people's checkers of MCAP files, each run as a process of its own.

``make check-log`` (``LOG=file`` for one of yours; else the sample frame is planned, by search alone). ``pymcap-cli
doctor`` checks the container, ``rerun mcap check`` what the viewer Rerun makes of its channels. A checker that is not
installed is named and passed over; one that finds something ends the run with 1.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

SAMPLE = Path(__file__).parents[1] / "sample_models" / "frame.ifc"
CHECKERS = (("pymcap-cli", "doctor"), ("rerun", "mcap", "check"))


def sample_log(folder: Path) -> Path:
    """Return the log of the sample frame, planned into a folder."""
    from pipeline.plan import plan
    from pipeline.progress import SilentProgress
    from pipeline.site import init

    site, log = folder / "frame.site.toml", folder / "frame.mcap"
    init(SAMPLE, site, progress=SilentProgress())
    plan(site, log, policy="none", progress=SilentProgress())
    return log


def main() -> int:
    """Run every checker there is; 1 where one finds something, or none is there."""
    tools, *given = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        log = Path(given[0]) if given else sample_log(Path(folder))
        codes = []
        for name, *arguments in CHECKERS:
            program = Path(tools) / name
            if not program.exists():
                print(f"not installed: {name}")
                continue
            print(f"{' '.join([name, *arguments])} {log.name}", flush=True)
            codes.append(subprocess.run([program, *arguments, log], check=False).returncode)
    print("found nothing" if codes and not any(codes) else "FAILED")
    return 0 if codes and not any(codes) else 1


if __name__ == "__main__":
    sys.exit(main())
