"""How the cost of `bimvox plan` grows with the number of components: ``make bench-scale``.

Plans and proves buildings of 50 to 5,000 components on 200 x 200 columns of cells, each in a separate process with an
empty policy store, and writes the table of ``docs/scale.md``, its data and its plot. A first small run compiles the
kernels. Times are wall times: run nothing else. With ``--sizes`` or ``--policy``, nothing in ``docs`` is changed unless
``--docs`` names a folder.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.document import put_into
from benchmarks.scale.measure import Measured, measure
from benchmarks.scale.report import Way, as_json, as_markdown, bars, drawing

_DOCS = Path(__file__).parents[2] / "docs"
_SIZES = (50, 100, 200, 500, 1000, 2000, 5000)
_WARM_UP = 12
_WAYS = (("as `bimvox plan` does it", None),)


def main() -> int:
    """Measure, print the tables, and write them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.scale", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=int, nargs="+", metavar="N", help="other numbers of components")
    parser.add_argument("--repeat", type=int, default=2, metavar="N", help="runs per size; the fastest counts")
    parser.add_argument("--policy", metavar="ID", help="the policy (default: that of `bimvox plan`)")
    parser.add_argument("--docs", type=Path, metavar="FOLDER", help="where to write (default docs, for all sizes)")
    options = parser.parse_args()
    chosen = [(f"by policy {options.policy}", options.policy)] if options.policy else list(_WAYS)
    ways = []
    with tempfile.TemporaryDirectory(prefix="bimvox-scale-") as scratch:
        for title, policy in chosen:
            measure(_WARM_UP, Path(scratch), policy)
            ways.append(Way(title, tuple(_sizes(options.sizes or _SIZES, Path(scratch), policy, options.repeat))))
    print(as_markdown(ways))
    docs = options.docs or (None if options.sizes or options.policy else _DOCS)
    if docs is not None:
        for folder in (docs / "data", docs / "images"):
            folder.mkdir(parents=True, exist_ok=True)
        (docs / "data" / "scale.json").write_text(as_json(ways), encoding="utf-8")
        (docs / "images" / "scale.png").write_bytes(drawing(ways))
        drawn = "![Processor time against components](images/scale.png)\n"
        put_into(docs / "scale.md", "bench-scale", f"{as_markdown(ways)}\n{drawn}")
    return 0 if all(bar.passed for way in ways for bar in bars(way.found)) else 1


def _sizes(sizes: Sequence[int], scratch: Path, policy: str | None, repeat: int) -> Iterator[Measured]:
    for size in sorted(sizes):
        one = _quickest(size, scratch, policy, repeat)
        print(f"{size}: {one.wall_s:.1f} s, {one.cpu_s:.1f} s of processor time", file=sys.stderr, flush=True)
        yield one


def _quickest(size: int, scratch: Path, policy: str | None, repeat: int) -> Measured:
    return min((measure(size, scratch, policy) for _ in range(max(1, repeat))), key=lambda one: one.wall_s)


if __name__ == "__main__":
    sys.exit(main())
