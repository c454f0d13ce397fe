"""Measures the voxelizer against its peers and writes tables, figures and a drawing: ``make bench-voxelize``.

Writes ``voxelizing.json``, ``voxelizing.png`` and, between its markers, the table of ``docs/voxelizing.md``. With
``--quick``, ``--model`` or ``--case``, nothing in ``docs`` is changed unless ``--docs`` names a folder.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from benchmarks.document import put_into
from benchmarks.voxelize.bars import check
from benchmarks.voxelize.case import full_cases, model_case, quick_cases
from benchmarks.voxelize.report import as_json, as_markdown
from benchmarks.voxelize.run import run_case

_DOCS = Path(__file__).parents[2] / "docs"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _write(docs: Path, json_text: str, tables: str, png: bytes) -> None:
    for folder in (docs / "data", docs / "images"):
        folder.mkdir(parents=True, exist_ok=True)
    (docs / "data" / "voxelizing.json").write_text(json_text, encoding="utf-8")
    (docs / "images" / "voxelizing.png").write_bytes(png)
    page = docs / "voxelizing.md"
    if page.exists():
        put_into(page, "bench-voxelize", tables)


def main() -> None:
    """Run the cases and print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.voxelize", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small cases: a trial of one minute")
    parser.add_argument("--model", type=Path, nargs="+", metavar="FILE", help="run on these IFC or mesh files instead")
    parser.add_argument("--voxel-size", type=float, default=0.1, metavar="M", help="cell of --model (default 0.1)")
    parser.add_argument("--case", action="append", metavar="TEXT", help="only cases whose names begin with this")
    parser.add_argument("--timeout", type=float, metavar="S", help="per tool and run (default 40; 10 with --quick)")
    parser.add_argument("--memory", type=float, default=12.0, metavar="GB", help="per tool (default 12)")
    parser.add_argument("--docs", type=Path, metavar="FOLDER", help="where to write (default docs, for the full run)")
    chosen = parser.parse_args()
    if chosen.model:
        specs = [model_case(path, chosen.voxel_size) for path in chosen.model]
    else:
        specs = quick_cases() if chosen.quick else full_cases()
    whole = not (chosen.quick or chosen.model or chosen.case)
    specs = [s for s in specs if not chosen.case or s.name.startswith(tuple(chosen.case))]
    if not specs:
        parser.error("--case matches no case")
    timeout_s = chosen.timeout or (10.0 if chosen.quick else 40.0)
    started_s = time.perf_counter()
    cases = [run_case(spec, timeout_s=timeout_s, memory_gb=chosen.memory, say=_say) for spec in specs]
    bars = check(cases)
    tables = as_markdown(cases, bars)
    docs = chosen.docs or (_DOCS if whole else None)
    if docs is not None:
        from benchmarks.voxelize.drawing import draw

        _write(docs, as_json(cases, bars), tables, draw(cases))
    print(tables)
    _say(f"{time.perf_counter() - started_s:.0f} s in all")


if __name__ == "__main__":
    main()
