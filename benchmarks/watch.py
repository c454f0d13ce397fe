"""The time of ``bimvox watch`` from the end of a change of the file to the new plan on disk.

``make bench-watch``: the table of docs/watching.md. Random changes on two sites:

- ``paper``: the paper's site, one lift on 15 x 15 x 6 cells, measured from the file's close to the synced segment.
- ``frame500``: 500 lifts on 200 x 200 x 60 cells, by search alone, measured to the verdict for all lifts with the first
  20 new lifts proven, timed and on disk, and separately to the last one.

Times are wall-clock times: run nothing else. The processor time of the watch is measured too, with what it writes in
the background. A histogram for each site is written to the output folder; ``--write`` puts the table into the page.
"""

from __future__ import annotations

import argparse
import json
import queue
import resource
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.document import put_into
from benchmarks.scale.building import write_site
from benchmarks.watch_changes import RandomObstructions

DOCUMENT = Path(__file__).parents[1] / "docs" / "watching.md"
PAPER = Path(__file__).parents[1] / "sample_models" / "paper.site.toml"
STEPS = 2_000
COMPONENTS = 500
_LIMIT_S = 600.0
_BOUND_MS = {"paper": 100.0, "frame500": 1000.0}


def main() -> int:
    """Run both sites and print the table."""
    options = _options()
    options.output.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in options.sites.split(","):
        with tempfile.TemporaryDirectory(prefix="bimvox-watch-") as scratch:
            rows.append(_measured(name, Path(scratch), options))
    text = table(rows)
    print(text)
    if options.write:
        put_into(DOCUMENT, "bench-watch", text)
    return 0


def _measured(name: str, scratch: Path, options: argparse.Namespace) -> dict[str, Any]:
    site = PAPER if name == "paper" else write_site(scratch, COMPONENTS)
    kept = options.output / f"{name}.mcap"  # planning 500 lifts takes minutes: a later run reuses the plan
    whole = kept if name != "paper" else scratch / f"{name}.mcap"
    with watcher_for(site, scratch, whole, name != "paper") as (watcher, file):
        found = _changes_of(name, watcher, file, options)
    (options.output / f"{name}.json").write_text("\n".join(json.dumps(row) for row in found))
    _draw(name, found, options.output)
    return {"name": name, "found": found}


def _changes_of(name: str, watcher: Any, file: Path, options: argparse.Namespace) -> list[dict[str, Any]]:
    said: queue.Queue[dict[str, Any]] = queue.Queue()
    stop = threading.Event()
    thread = threading.Thread(target=_follow, args=(watcher, stop, said), daemon=True)
    file.write_bytes(b'{"version": 1, "unit": "m", "obstructions": []}')
    thread.start()
    _print(said.get(timeout=3600))
    while watcher.is_cold:
        time.sleep(0.1)
    time.sleep(2.0)
    random = RandomObstructions(watcher.current.plan, options.seed)
    found = []
    for number in range(options.changes):
        file.write_bytes(random.change())
        closed_s, used_s = time.monotonic(), _used_s()
        documents = [said.get(timeout=_LIMIT_S)]
        while documents[-1].get("pending"):
            documents.append(said.get(timeout=_LIMIT_S))
        found.append(_row(documents, closed_s, used_s))
        if number % 20 == 19:
            print(f"{name}: {number + 1} of {options.changes}", file=sys.stderr, flush=True)
    stop.set()
    thread.join()
    return found


@contextmanager
def watcher_for(site: Path, scratch: Path, log: Path, search_only: bool) -> Iterator[tuple[Any, Path]]:
    """Yield a watcher of a file in the scratch folder, and the file."""
    from bimvox_pipeline.watch.plan import WatchedPlan
    from bimvox_pipeline.watch.watch import Watcher

    from bimvox.library.arguments import PolicyWish, constants_of, workers_of
    from bimvox.library.plan import policy_of
    from bimvox.library.prove import prepared
    from bimvox.library.site import load_site
    from bimvox.policy.choice import NO_POLICY
    from bimvox.progress import SilentProgress

    quiet = SilentProgress()
    loaded = load_site(site, quiet)
    with workers_of(loaded.site, None) as workers:
        _, preparation = prepared(loaded.site, quiet, workers)
        policy = NO_POLICY
        if not search_only:
            policy = policy_of(loaded, loaded.site, preparation, PolicyWish(steps=STEPS), quiet)
        file = scratch / "obstructions.json"
        with workers.knowing(*constants_of(loaded.site, preparation)):
            yield Watcher(WatchedPlan(loaded, policy, log, 0), preparation, file, quiet, None, workers), file


def _follow(watcher: Any, stop: threading.Event, said: queue.Queue[dict[str, Any]]) -> None:
    from bimvox_pipeline.watch.watch import follow

    for document in follow(watcher, once=False, poll_s=None, stop=stop):
        said.put(document | {"heard_s": time.monotonic(), "used_s": _used_s()})


def _used_s() -> float:
    """Return the processor time of this process and of its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def _row(documents: list[dict[str, Any]], closed_s: float, used_s: float) -> dict[str, Any]:
    """Return the duration and effect of a change; times in ms from the file's close."""
    first, last = documents[0], documents[-1]
    decided = next((d for d in documents if not d.get("undecided")), last)
    first_ms, all_ms = ((d["heard_s"] - closed_s) * 1000.0 for d in (first, last))
    noticed_ms = first_ms - first["latency_ms"]
    return {
        "event": first["event"],
        "first_ms": first_ms,
        "all_ms": all_ms,
        "cpu_ms": (first["used_s"] - used_s) * 1000.0,
        "cpu_all_ms": (last["used_s"] - used_s) * 1000.0,
        "verdict_ms": noticed_ms + decided.get("verdict_ms", decided["latency_ms"]),
        "stages_ms": {"notice": noticed_ms} | first.get("stages_ms", {}),
        "new": len(last["replanned"]) + len(last["retimed"]),
        "replanned": len(last["replanned"]),
        "kept": len(last["kept"]),
        "infeasible": len(last["infeasible"]),
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Return the measurements as a Markdown table, with the time by stage."""
    lines = [
        "| site | changes | lifts made anew (median, most) | verdict p50 / p95 / max "
        "| first lifts on disk p50 / p95 / max | all on disk p50 / p95 / max "
        "| processor time until the first are on disk p50 / p95 / max |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        found = row["found"]
        new = [r["new"] for r in found]
        lines.append(
            f"| {row['name']} | {len(found)} | {np.median(new):.0f}, {max(new)} | {_quantiles(found, 'verdict_ms')} "
            f"| {_quantiles(found, 'first_ms')} | {_quantiles(found, 'all_ms')} | {_quantiles(found, 'cpu_ms')} |"
        )
    lines.append("")
    for row in rows:
        stages: Counter[str] = Counter()
        for r in row["found"]:
            stages.update(r["stages_ms"])
        total = sum(stages.values()) or 1.0
        shares = ", ".join(f"{stage} {value / total:.0%}" for stage, value in stages.items())
        events = Counter(r["event"] for r in row["found"])
        told = ", ".join(f"{count} {event}" for event, count in events.items())
        lines.append(f"Where the time of {row['name']} goes: {shares}. Events: {told}.")
        lines.append("")
    return "\n".join(lines).rstrip()


def _quantiles(found: list[dict[str, Any]], key: str) -> str:
    values = [row[key] for row in found]
    return " / ".join(f"{value:.0f}" for value in (*np.quantile(values, [0.5, 0.95]), max(values))) + " ms"


def _draw(name: str, found: list[dict[str, Any]], folder: Path) -> None:
    try:
        from benchmarks.plots import draw_latencies
    except ImportError as error:
        print(f"no histogram: {error}", file=sys.stderr)
        return
    picture = draw_latencies([row["first_ms"] for row in found], _BOUND_MS[name])
    (folder / f"watch-{name}.png").write_bytes(picture)


def _print(document: dict[str, Any]) -> None:
    print({k: len(v) if isinstance(v, list) else v for k, v in document.items()}, file=sys.stderr, flush=True)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--changes", type=int, default=200, help="changes per site")
    parser.add_argument("--sites", default="paper,frame500", help="sites, separated by commas")
    parser.add_argument("--seed", type=int, default=0, help="seed of the changes")
    parser.add_argument("--write", action="store_true", help="put the table into docs/watching.md")
    parser.add_argument(
        "--output", type=Path, default=Path("demo-output/watch"), help="folder for figures and histograms"
    )
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
