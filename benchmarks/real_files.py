"""Real files, planned as a stranger would: ``make bench-real-files`` (ARGS="FOLDER ..." for more than the samples).

For each building file: ``init`` and ``plan --policy none`` without an edit, and ``verify``, each in a process of its
own. Times are processor time of one thread, with the processes that mesh an IFC file, so another load on the machine
changes them little. The kernels are compiled by a small file first. ``--write`` puts the table into docs/measured.md;
``--profile`` writes a cProfile of every plan.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from benchmarks.document import put_into
from bimvox.errors import BimvoxError
from bimvox.library.arguments import PolicyWish
from bimvox.progress import SilentProgress

DOCUMENT = Path(__file__).parents[1] / "docs" / "measured.md"
SAMPLES = Path(__file__).parents[1] / "sample_models"
MODELS = (".ifc", ".glb", ".gltf", ".obj", ".stl", ".ply")
STAGES = {
    "read": ("open", "geometry", "elements"),
    "site": ("site", "voxelize"),
    "contacts": ("contacts",),
    "order, yard": ("order",),
    "paths": ("plan", "lifts"),
    "motions": ("time",),
    "proof": ("prove",),
    "log": ("write",),
}
"""Columns of the table, with the stages that ``plan`` reports."""
_PART_COLUMNS = ("planned", "by other means", "in_situ", "built", "by_hand", "refused")


class CpuProgress(SilentProgress):
    """Measures processor time by stage."""

    def __init__(self) -> None:
        super().__init__()
        self.cpu_s: defaultdict[str, float] = defaultdict(float)
        self._begun_s = 0.0

    def stage(self, name: str, total: int | None = None) -> AbstractContextManager[None]:
        """Start a stage."""
        ends = super().stage(name, total)
        self._begun_s = _used_s()
        return ends

    def finish(self) -> None:
        """End the running stage."""
        if self.name is not None:
            self.cpu_s[self.name] += _used_s() - self._begun_s
        super().finish()


def _used_s() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def measure(model: Path, folder: Path, profile: Path | None = None, policy: str = "none") -> dict[str, Any]:
    """Run init, plan and verify on a file in this process.

    Returns:
        Counts of parts, machine, processor seconds by column, and whether the log is verified; or the error.
    """
    from bimvox_pipeline.plan import plan
    from bimvox_pipeline.site import init
    from bimvox_pipeline.verify import verify

    site, log = folder / "site.toml", folder / "plan.mcap"
    progress, profiler = CpuProgress(), cProfile.Profile(time.process_time)
    begun_s = _used_s()
    try:
        made = init(model, site, progress=CpuProgress())
        init_s = _used_s() - begun_s
        if profile is not None:
            profiler.enable()
        document = plan(site, log, wish=PolicyWish(policy), progress=progress)
        profiler.disable()
        planned_s = _used_s()
        proof = verify(log, progress=CpuProgress())
    except BimvoxError as error:
        return {"model": model.name, "error": str(error).splitlines()[0]}
    if profile is not None:
        profiler.dump_stats(profile / f"{model.name}.prof")
    stages_s = {column: sum(progress.cpu_s[stage] for stage in stages) for column, stages in STAGES.items()}
    other = {lift["number"] for lift in document["infeasible"] if lift["by_other_means"]}
    status = Counter(
        "by other means" if lift["number"] in other else "refused" if lift["status"] == "infeasible" else lift["status"]
        for lift in document["lifts"]
    )
    return {
        "model": model.name,
        "parts": len(document["lifts"]),
        "counts": {name: status[name] for name in _PART_COLUMNS},
        "ground_m": made["ground_m"],
        "kinds": dict(Counter(lift["kind"] for lift in document["lifts"]).most_common()),
        "assumed": sum(lift["confidence"] == "assumed" for lift in document["lifts"]),
        "machine": ", ".join(crane["machine"] for crane in document["cranes"]) or "-",
        "seconds": {
            "init": init_s,
            **stages_s,
            "plan": sum(stages_s.values()),
            "verify": _used_s() - planned_s,
        },
        "verified": proof["verified"],
    }


def models_in(paths: Iterable[Path]) -> list[Path]:
    """Return the building files among the paths and directly in the folders."""
    found = (sorted(path.iterdir()) if path.is_dir() else [path] for path in paths)
    return [file for files in found for file in files if file.suffix.lower() in MODELS]


_IN_WORDS = {"by other means": "by other means", "in_situ": "cast", "built": "built"}
_IN_WORDS |= {"by_hand": "by hand", "refused": "refused"}
"""Parts that are not planned, by their count."""


def page(rows: Sequence[dict[str, Any]]) -> str:
    """Return the measurements as the page has them: the other parts in words, the stages of the longest plan."""
    lines = [
        "| model | ground, m | parts | planned | the others | kinds | assumed | machine "
        "| init, s | plan, s | verify, s |",
        "|---|---:|---:|---:|---|---|---:|---|---:|---:|---:|",
    ]
    for row in rows:
        if "error" in row:
            lines.append(f"| {row['model']} | {row['error']} |")
            continue
        others = (f"{row['counts'][key]} {word}" for key, word in _IN_WORDS.items() if row["counts"][key])
        seconds = " | ".join(f"{row['seconds'][name]:.1f}" for name in ("init", "plan", "verify"))
        machine = row["machine"] + ", NOT VERIFIED" * (not row["verified"])
        planned = row["counts"]["planned"]
        kinds = ", ".join(f"{count} {kind}" for kind, count in row["kinds"].items())
        lines.append(
            f"| {row['model']} | {row['ground_m']:g} | {row['parts']} | {planned} | {', '.join(others)} | {kinds} "
            f"| {row['assumed']} | {machine} | {seconds} |"
        )
    done = [row for row in rows if "error" not in row]
    if not done:
        return "\n".join(lines)
    planned, parts = (
        sum(counts) for counts in zip(*((row["counts"]["planned"], row["parts"]) for row in done), strict=True)
    )
    longest = max(done, key=lambda row: float(row["seconds"]["plan"]))
    stages = ", ".join(f"{name} {longest['seconds'][name]:.1f}" for name in STAGES)
    verified = sum(row["verified"] for row in done)
    told = f"{planned:,} of {parts:,} parts are planned, {verified} of {len(rows)} plans verified."
    return "\n".join([*lines, "", f"{told} The plan of {longest['model']} by stage, s: {stages}."])


def table(rows: Sequence[dict[str, Any]], columns: Sequence[str] = ("init", *STAGES, "verify")) -> str:
    """Return the measurements as a Markdown table, with the sum of the parts."""
    lines = [
        "| model | parts | planned | by other means | cast | built | by hand | refused | machine | verified | "
        + " | ".join(f"{name}, s" for name in columns)
        + " |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---|---|" + "---:|" * len(columns),
    ]
    done = [row for row in rows if "error" not in row]
    for row in rows:
        if "error" in row:
            lines.append(f"| {row['model']} | {row['error']} |" + " |" * (8 + len(columns)))
            continue
        counts = " | ".join(str(row["counts"][name]) for name in _PART_COLUMNS)
        seconds = " | ".join(f"{row['seconds'][name]:.1f}" for name in columns)
        verified = "yes" if row["verified"] else "NO"
        lines.append(f"| {row['model']} | {row['parts']} | {counts} | {row['machine']} | {verified} | {seconds} |")
    sums = " | ".join(f"{sum(row['counts'][name] for row in done):,}" for name in _PART_COLUMNS)
    lines.append(f"| all | {sum(row['parts'] for row in done):,} | {sums} |" + " |" * (2 + len(columns)))
    return "\n".join(lines)


def main() -> int:
    """Measure every file and print the table."""
    options = _options()
    if options.only is not None:
        with tempfile.TemporaryDirectory() as folder:
            options.only.write_text(
                json.dumps(measure(options.models[0], Path(folder), options.profile, options.policy))
            )
        return 0
    if options.profile is not None:
        options.profile.mkdir(parents=True, exist_ok=True)
    _measured(SAMPLES / "paper.ifc", options)  # compiles the kernels
    rows = [_measured(model, options) for model in models_in(options.models or [SAMPLES])]
    print(table(rows))
    if options.write:
        put_into(DOCUMENT, "bench-real-files", page(rows))
    return 0 if all(row.get("verified") for row in rows) else 1


def _measured(model: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Measure a file in a separate process."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        command = [sys.executable, "-m", "benchmarks.real_files", str(model.resolve()), "--only", str(answer)]
        command += ["--policy", options.policy]
        command += ["--profile", str(options.profile.resolve())] if options.profile else []
        one_thread = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
        try:
            ended = subprocess.run(command, env=os.environ | one_thread, timeout=options.limit_s, check=False)
            why = f"ended with {ended.returncode}"
        except subprocess.TimeoutExpired:
            why = f"not done in {options.limit_s:g} s"
        row = json.loads(answer.read_text()) if answer.exists() else {"model": model.name, "error": why}
    print(f"{model.name}: {row.get('counts') or row['error']}", file=sys.stderr, flush=True)
    return dict(row)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", type=Path, nargs="*", help="files, or folders of them; default: sample_models")
    parser.add_argument("--limit-s", type=float, default=3600.0, help="longest wall time of a file")
    parser.add_argument("--policy", default="none", help="what proposes the paths; greedy: the default of a plan")
    parser.add_argument("--profile", type=Path, metavar="FOLDER", help="write a cProfile of every plan")
    parser.add_argument("--write", action="store_true", help="put the table into docs/measured.md")
    parser.add_argument("--only", type=Path, metavar="JSON", help=argparse.SUPPRESS)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
