"""Plans and proves every sample model from scratch, and prints the results as a Markdown table.

``make bench``: a table of docs/data/measured.txt (ARGS=--write renews it); it does not depend on the machine.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.document import MEASURED, put_into

SAMPLES = Path(__file__).parents[1] / "sample_models"
MODELS = ("paper.ifc", "frame.ifc", "frame_georeferenced.ifc", "prefab.ifc", "yard.glb")


def measure(model: Path, folder: Path) -> dict[str, Any]:
    """Run init, plan and verify on a model and return their documents."""
    from bimvox_pipeline.plan import plan
    from bimvox_pipeline.site import init
    from bimvox_pipeline.verify import verify

    from bimvox.progress import SilentProgress

    site = folder / f"{model.name}.site.toml"
    log = folder / f"{model.name}.mcap"
    init(model, site, progress=SilentProgress())
    document = plan(site, log, progress=SilentProgress())
    proof = verify(log, progress=SilentProgress())
    return {"plan": document, "proof": proof, "log_mb": log.stat().st_size / 1e6}


def row(name: str, found: dict[str, Any]) -> str:
    """Return a model's row of the table."""
    document = found["plan"]
    lifts = [lift for lift in document["lifts"] if lift["status"] == "planned"]
    proposed = sum(lift["method"] != "search" for lift in lifts)
    ratio = sum(lift["moves"] for lift in lifts) / max(1, sum(lift["shortest_moves"] for lift in lifts))
    timed = [lift for lift in lifts if lift["duration_s"] is not None]
    times = f"{sum(t['duration_s'] for t in timed) / sum(t['bound_s'] for t in timed):.2f}" if timed else "-"
    samples = sum(check["samples"] for check in found["proof"]["checks"].values())
    return (
        f"| {name} | {len(lifts)} of {len(document['lifts'])} | {proposed} / {len(lifts) - proposed} "
        f"| {ratio:.3f} | {times} "
        f"| {'yes' if found['proof']['verified'] else 'NO'} ({samples / 1e6:.1f} M) | {found['log_mb']:.1f} MB |"
    )


def main() -> None:
    """Measure every sample, with one policy store that is empty at the start."""
    lines = [
        "| model | lifts planned | greedy / by search | moves / shortest | crane time / bound "
        "| proven (samples) | log |",
        "|---|---|---|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BIMVOX_POLICIES"] = str(Path(folder) / "policies")
        lines += [row(name, measure(SAMPLES / name, Path(folder))) for name in MODELS]
    print(*lines, sep="\n")
    if "--write" in sys.argv:
        put_into(MEASURED, "bench", "\n".join(lines))


if __name__ == "__main__":
    main()
