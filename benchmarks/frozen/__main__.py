"""Compares the bytes that the program writes with those in ``benchmarks/frozen.json``: ``make bench-frozen``.

A difference is reported by case, file and part: a topic, an attachment, a metadata record, a key of a JSON document, or
a member of a zip.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks.frozen.cases import Case, cases
from benchmarks.frozen.record import RECORD, Recorded, differences, read, write
from benchmarks.frozen.workshop import RunError, Workshop


def main() -> int:
    """Run the cases, and store or compare their output."""
    options = _options()
    if options.one_core:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    chosen = {name: case for name, case in cases().items() if _is_chosen(name, options.only)}
    if not chosen:
        print(f"--only matches no case; cases are {', '.join(cases())}", file=sys.stderr)
        return 2
    started_s = time.perf_counter()
    with _folder(options.keep) as folder:
        found = _run(chosen, Workshop(folder), options.jobs)
    print(f"{len(found)} of {len(chosen)} cases ran, {time.perf_counter() - started_s:.0f} s", flush=True)
    known = read()
    if options.write:
        write({name: (known | found)[name] for name in cases() if name in known | found})
        return 0 if len(found) == len(chosen) else 1
    told = [line for name in found for line in differences(known.get(name), found[name], name)]
    print("\n".join(told or [f"no difference from {RECORD.name}"]))
    return 1 if told or len(found) < len(chosen) else 0


def _run(chosen: Mapping[str, Case], workshop: Workshop, jobs: int) -> dict[str, Recorded]:
    """Return the output of the cases; a failed case is reported and omitted."""

    def one(name: str) -> Recorded | None:
        started_s, why = time.perf_counter(), ""
        try:
            return chosen[name](workshop)
        except (RunError, OSError, ValueError) as error:
            why = f"  FAILED: {error}"
            return None
        finally:
            print(f"{name:28} {time.perf_counter() - started_s:6.1f} s{why}", flush=True)

    with ThreadPoolExecutor(jobs) as pool:
        results = zip(chosen, pool.map(one, chosen), strict=True)
        return {name: found for name, found in results if found is not None}


@contextlib.contextmanager
def _folder(keep: Path | None) -> Iterator[Path]:
    if keep is not None:
        keep.mkdir(parents=True)
        yield keep.resolve()
        return
    with tempfile.TemporaryDirectory(prefix="bimvox-frozen-") as name:
        yield Path(name)


def _is_chosen(name: str, only: list[str] | None) -> bool:
    return not only or any(text in name for text in only)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.frozen", description=__doc__)
    parser.add_argument("--write", action="store_true", help="record the current output")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="only cases whose names contain one of these")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="cases at a time (default 2)")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep the output in this new folder")
    parser.add_argument("--one-core", action="store_true", help="use one core only")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
