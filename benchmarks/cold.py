"""``python -m benchmarks.cold``: what a first run costs, before the kernels are compiled, beside a later one.

The commands of the demo run twice, first with an empty folder of machine code. Processor time counts all processes and
hardly depends on other load on the machine; what the first run needs more is compiling.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bimvox.kernel_list import written

_LIST = Path(__file__).parents[1] / "bimvox" / "kernels.json"
_SAMPLE = Path(__file__).parents[1] / "sample_models" / "prefab.ifc"
_ACTS = {
    "voxelize": ("voxelize", str(_SAMPLE), "-o", "prefab.zarr.zip"),
    "init": ("init", str(_SAMPLE), "-o", "prefab.site.toml", "--force"),
    "plan": ("plan", "prefab.site.toml", "-o", "prefab.mcap"),
    "verify": ("verify", "prefab.mcap"),
    "render": ("render", "prefab.mcap", "-o", "prefab.png"),
}


@dataclass(frozen=True, slots=True)
class Spent:
    """What one command took, and how many files of machine code it added."""

    processor_s: float
    wall_s: float
    kernels: int


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", choices=("warm-up",), help="run this before the demo's commands, and count it too")
    parser.add_argument("--write", action="store_true", help="write bimvox/kernels.json, which `warm-up` compiles")
    chosen = parser.parse_args()
    acts = ({chosen.first: (chosen.first,)} if chosen.first else {}) | _ACTS
    if chosen.write:
        _write()
        return
    with tempfile.TemporaryDirectory() as folder:
        runs = [{name: _spent(Path(folder), act) for name, act in acts.items()} for _ in range(2)]
    lines = [
        "| command | kernels compiled | compiling, s of processor time | wall, s: first | later |",
        "|---|---|---|---|---|",
    ]
    for name in acts:
        first, later = runs[0][name], runs[1][name]
        compiling = first.processor_s - later.processor_s
        lines.append(f"| {name} | {first.kernels} | {compiling:.1f} | {first.wall_s:.1f} | {later.wall_s:.1f} |")
    processor_s = [sum(one.processor_s for one in run.values()) for run in runs]
    walls_s = [sum(one.wall_s for one in run.values()) for run in runs]
    kernels = sum(one.kernels for one in runs[0].values())
    lines.append(f"| all | {kernels} | {processor_s[0] - processor_s[1]:.1f} | {walls_s[0]:.1f} | {walls_s[1]:.1f} |")
    sys.stdout.write("\n".join(lines) + "\n")


def _write() -> None:
    text = _LIST.read_text("utf-8")
    _LIST.write_text("{}\n", "utf-8")  # otherwise a helper compiles what the old list asks for
    try:
        with tempfile.TemporaryDirectory() as temporary:
            folder, entries = Path(temporary), {}
            for name, act in _ACTS.items():
                known = list(folder.rglob("*.nbc"))
                _spent(folder, act)
                entries[name] = written(folder, known)
        text = text_of(entries)
    finally:  # if a command fails, the list stays as it was
        _LIST.write_text(text, "utf-8")


def text_of(entries: Mapping[str, Sequence[object]]) -> str:
    """Return the list of kernels as JSON, a kernel a line."""
    acts = [f'"{name}": [\n' + ",\n".join(map(json.dumps, one)) + "\n]" for name, one in entries.items()]
    return "{\n" + ",\n".join(acts) + "\n}\n"


def _spent(folder: Path, act: tuple[str, ...]) -> Spent:
    cache = folder / "kernels"
    before, clock, there = _children_s(), time.perf_counter(), len(list(cache.rglob("*.nbc")))
    subprocess.run(
        [sys.executable, "-m", "bimvox_cli", *act, "-q"],
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        check=True,
    )
    return Spent(_children_s() - before, time.perf_counter() - clock, len(list(cache.rglob("*.nbc"))) - there)


def _children_s() -> float:
    spent = os.times()
    return spent.children_user + spent.children_system


if __name__ == "__main__":
    main()
