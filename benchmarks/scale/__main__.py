"""How the cost of `bimvox plan` grows with the number of components: ``make bench-scale``.

Plans and proves buildings of 50 to 1,000 components on 200 x 200 x 60 cells, each in a process of its own with an empty
policy store, without training, and writes the tables of ``docs/scale.md``, their data and their drawing. A first small
run compiles the kernels. Wall times: let nothing else run. With ``--sizes`` nothing in ``docs`` is touched unless
``--docs`` names a folder.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.document import put_into
from benchmarks.scale.measure import Measured, measure
from benchmarks.scale.report import as_json, as_markdown, bars, drawing

_DOCS = Path(__file__).parents[2] / "docs"
_SIZES = (50, 100, 200, 500, 1000)
_WARM_UP = 12


def main() -> int:
    """Measure, print the tables, and write them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.scale", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=int, nargs="+", metavar="N", help="other numbers of components")
    parser.add_argument("--repeat", type=int, default=2, metavar="N", help="runs a size; the quickest counts")
    parser.add_argument("--policy", default="none", metavar="ID", help="what proposes paths (default none: search)")
    parser.add_argument("--docs", type=Path, metavar="FOLDER", help="where to write (default docs, for all sizes)")
    options = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory(prefix="bimvox-scale-") as scratch:
        measure(_WARM_UP, Path(scratch), options.policy)
        for size in sorted(options.sizes or _SIZES):
            found.append(_quickest(size, Path(scratch), options.policy, options.repeat))
            one = found[-1]
            print(f"{size}: {one.wall_s:.1f} s, {one.cpu_s:.1f} s of processor time", file=sys.stderr, flush=True)
    print(as_markdown(found))
    docs = options.docs or (None if options.sizes else _DOCS)
    if docs is not None:
        for folder in (docs / "data", docs / "images"):
            folder.mkdir(parents=True, exist_ok=True)
        (docs / "data" / "scale.json").write_text(as_json(found), encoding="utf-8")
        (docs / "images" / "scale.png").write_bytes(drawing(found))
        drawn = "![Processor time against components](images/scale.png)\n"
        put_into(docs / "scale.md", "bench-scale", f"{as_markdown(found)}\n{drawn}")
    return 0 if all(bar.passed for bar in bars(found)) else 1


def _quickest(size: int, scratch: Path, policy: str, repeat: int) -> Measured:
    return min((measure(size, scratch, policy) for _ in range(max(1, repeat))), key=lambda one: one.wall_s)


if __name__ == "__main__":
    sys.exit(main())
