"""Runs `bimvox voxelize` on every building file of a folder: each must give a grid or a clear error.

``make soak-files DIR=folder``: the command runs on every file in a separate process, forked from one that has loaded
all modules. The outcome is

- ``grid``: exit code 0, and a grid file was written;
- ``error``: exit code 2 and one of our errors, which says what is wrong with the file;
- ``DEFECT``: anything else: a fault, a traceback, a signal, a hang, another exit code, or a process or temporary file
  left behind.

With ``--truncate N`` and ``--flip N``, some of the files are also run truncated at a random place, and with some random
bytes changed; the same rule applies to them. The exit code is 1 if there is any defect.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import random
import signal
import statistics
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

SUFFIXES = (".ifc", ".ifczip")
BYTES_FLIPPED = 8
_PROCESSES = multiprocessing.get_context("forkserver")
_ONE_AT_A_TIME = threading.Lock()
"""Starting a process also polls the others, and the exit status of a forked process can be read only once."""
_MARK = "BIMVOX_SOAK_MARK"
_LOOK_EVERY_S = 0.05


def main() -> int:
    """Run all files and print their outcomes."""
    options = _options()
    done: dict[str, dict[str, Any]] = {}
    if options.resume and options.json and options.json.exists():
        done = {row["file"]: row for row in map(json.loads, options.json.read_text().splitlines())}
    elif options.json:
        options.json.unlink(missing_ok=True)
    rows = list(done.values())
    _PROCESSES.set_forkserver_preload(["benchmarks.loaded"])
    with tempfile.TemporaryDirectory(prefix="bimvox-soak-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        todo = [(path, label) for path, label in _inputs(options, Path(folder)) if label not in done]
        for number, run in enumerate(as_completed([pool.submit(run_file, *item, options) for item in todo]), start=1):
            row = run.result()
            rows.append(row)
            print(f"[{number}/{len(todo)}] {_line(row)}", flush=True)
            if options.json:
                with options.json.open("a") as stream:
                    stream.write(json.dumps(row) + "\n")
    print()
    print(summary(rows))
    return int(any(row["outcome"] == "DEFECT" for row in rows))


def run_file(path: Path, label: str, options: argparse.Namespace) -> dict[str, Any]:
    """Voxelize one file in a separate process and classify its outcome."""
    with tempfile.TemporaryDirectory(prefix="bimvox-soak-file-") as folder:
        scratch, out = Path(folder) / "tmp", Path(folder) / "out"
        scratch.mkdir()
        out.mkdir()
        mark = f"{os.getpid()}-{Path(folder).name}"
        arguments = ["voxelize", str(path), "-o", str(out / "grid.zarr.zip"), "--json", "--quiet", *options.option]
        started_s = time.monotonic()
        process = _PROCESSES.Process(target=_voxelize, args=(arguments, folder, mark))
        with _ONE_AT_A_TIME:
            process.start()
        peak_mb, late = _watch(process, options.timeout)
        wall_s = time.monotonic() - started_s
        left = _marked(mark)
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        text, complaint = ((Path(folder) / name).read_text(errors="replace") for name in ("stdout", "stderr"))
        row: dict[str, Any] = {
            "file": label,
            "bytes": path.stat().st_size,
            "wall_s": round(wall_s, 2),
            "peak_mb": round(peak_mb),
            **judged(_status(process) or 0, text, complaint, options.timeout if late else None),
        }
        files = sorted(item.name for item in out.iterdir())
        if row["outcome"] == "grid" and files != ["grid.zarr.zip"]:
            row |= {"outcome": "DEFECT", "why": f"files written: {files}"}
        if row["outcome"] == "error" and files:
            row |= {"outcome": "DEFECT", "why": f"files left behind: {files}"}
        if row["outcome"] != "DEFECT" and any(scratch.iterdir()):
            row |= {"outcome": "DEFECT", "why": f"temporary files left: {[item.name for item in scratch.iterdir()]}"}
        if row["outcome"] != "DEFECT" and left:
            row |= {"outcome": "DEFECT", "why": f"{len(left)} processes left behind"}
    return row


def _voxelize(arguments: list[str], folder: str, mark: str) -> None:
    """Run the command in this process, which was forked for it."""
    from bimvox_cli.main import run

    os.setsid()
    os.environ |= {_MARK: mark, "TMPDIR": str(Path(folder) / "tmp"), "NO_COLOR": "1"}
    tempfile.tempdir = None
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open(Path(folder) / name, os.O_WRONLY | os.O_CREAT), descriptor)
    code = run(arguments)
    sys.stdout.flush()
    sys.stderr.flush()
    raise SystemExit(code)


def judged(code: int, text: str, complaint: str, timeout_s: float | None) -> dict[str, Any]:
    """Return the outcome of one run and its message."""
    if timeout_s is not None:
        return {"outcome": "DEFECT", "why": f"not done after {timeout_s:g} s"}
    if code < 0:
        return {"outcome": "DEFECT", "why": f"killed by {signal.Signals(-code).name}"}
    try:
        document = json.loads(text)
    except ValueError:
        return {"outcome": "DEFECT", "why": f"exit code {code}, stdout is not a JSON document: {complaint[-300:]}"}
    if code == 0:
        shape = document["shape"]
        return {
            "outcome": "grid",
            "shape": shape,
            "voxel_size_m": document["voxel_size_m"],
            "parts": len(document["components"]) + len(document["others"]),
            "components": len(document["components"]),
            "skipped": len(document["skipped"]),
            "reasons": dict(Counter(item["reason"].split("; its")[0] for item in document["skipped"])),
            "fills": dict(Counter(part["fill"] for part in (*document["components"], *document["others"]))),
            "notes": document["notes"],
            "seconds": document["seconds"],
        }
    error = document.get("error", {})
    if code == 2 and error.get("code") not in (None, "fault", "usage") and "Traceback" not in complaint:
        return {"outcome": "error", "code": error["code"], "message": error["message"], "hint": error["hint"]}
    return {"outcome": "DEFECT", "why": f"exit code {code}: {error.get('message') or complaint[-300:]}"}


def _watch(process: Any, timeout_s: float) -> tuple[float, bool]:
    """Wait for a process; return the peak memory (MB) of it and its children, and whether it timed out."""
    peak, late, end_s = 0.0, False, time.monotonic() + timeout_s
    while _status(process) is None:
        peak = max(peak, sum(_resident_mb(pid) for pid in _family(process.pid)))
        if time.monotonic() > end_s:
            late = True
            process.kill()
        time.sleep(_LOOK_EVERY_S)
    return peak, late


def _status(process: Any) -> int | None:
    with _ONE_AT_A_TIME:
        return process.exitcode  # type: ignore[no-any-return]


def _family(pid: int) -> Iterator[int]:
    """Yield a process and all its descendants."""
    yield pid
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return
    for child in children:
        yield from _family(int(child))


def _resident_mb(pid: int) -> float:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, IndexError):
        return 0.0


def _marked(mark: str) -> list[int]:
    """Return the processes that still run with our mark in their environment (a worker has its own session)."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and f"{_MARK}={mark}".encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def _inputs(options: argparse.Namespace, folder: Path) -> list[tuple[Path, str]]:
    """Return the files to run, the damaged copies last, each with its name in the table."""
    files = sorted(path for path in options.folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    inputs = [(path, str(path.relative_to(options.folder))) for path in files]
    chance = random.Random(options.seed)
    for kind, number in (("truncate", options.truncate), ("flip", options.flip)):
        for path in sorted(chance.sample(files, min(number, len(files)))):
            data = bytearray(path.read_bytes())
            if kind == "truncate":
                data = data[: chance.randrange(1, len(data))]
            else:
                for _ in range(BYTES_FLIPPED):
                    data[chance.randrange(len(data))] = chance.randrange(256)
            copy = folder / f"{kind}-{len(inputs)}{path.suffix}"
            copy.write_bytes(data)
            inputs.append((copy, f"{kind}:{path.relative_to(options.folder)}"))
    return inputs


def _line(row: dict[str, Any]) -> str:
    told = {"error": row.get("message"), "DEFECT": row.get("why")}.get(row["outcome"])
    if row["outcome"] == "grid":
        told = f"{'x'.join(map(str, row['shape']))} at {row['voxel_size_m']:g} m, {row['parts']} parts"
    return f"{row['outcome']:6} {row['wall_s']:6.1f} s {row['peak_mb']:5} MB  {row['file'][-60:]}: {told}"


def summary(rows: list[dict[str, Any]]) -> str:
    """Return the Markdown tables: outcomes, error messages, slowest files."""
    lines = ["| outcome | files |", "|---|---|"]
    lines += [f"| {outcome} | {count} |" for outcome, count in Counter(row["outcome"] for row in rows).most_common()]
    if errors := Counter(_kind(row["message"], row["file"]) for row in rows if row["outcome"] == "error"):
        lines += ["", "| error | files |", "|---|---|", *(f"| {kind} | {n} |" for kind, n in errors.most_common())]
    grids = [row for row in rows if row["outcome"] == "grid"]
    if grids:
        wall_s = [row["wall_s"] for row in grids]
        lines += [
            "",
            f"{sum(row['parts'] for row in grids):,} parts; {sum(row['skipped'] for row in grids):,} products left out;"
            f" seconds: median {statistics.median(wall_s):.1f}, most {max(wall_s):.1f};"
            f" memory: median {statistics.median(row['peak_mb'] for row in grids):.0f} MB,"
            f" most {max(row['peak_mb'] for row in grids):,} MB.",
        ]
    for row in rows:
        if row["outcome"] == "DEFECT":
            lines.append(f"DEFECT {row['file']}: {row['why']}")
    return "\n".join(lines)


def _kind(message: str, label: str) -> str:
    """Return an error's message without path and numbers, so that equal ones are counted together."""
    text = message.split(": ", 1)[-1] if Path(label).suffix.lower() in message.lower() else message
    return "".join("N" if character.isdigit() else character for character in text)[:90].replace("|", "/")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="every .ifc and .ifczip below it is run")
    parser.add_argument("--timeout", type=float, default=600.0, metavar="S", help="seconds a file may take")
    parser.add_argument("--json", type=Path, metavar="OUT", help="write a JSON object per file, one a line")
    parser.add_argument("--resume", action="store_true", help="skip files that OUT already contains")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="files run at a time")
    parser.add_argument("--truncate", type=int, default=0, metavar="N", help="also run N truncated files")
    parser.add_argument("--flip", type=int, default=0, metavar="N", help="also run N files with bytes changed")
    parser.add_argument("--seed", type=int, default=1, help="seed of the damage")
    parser.add_argument("--option", action="append", default=[], metavar="ARG", help="passed on to bimvox voxelize")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
