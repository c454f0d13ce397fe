"""The cases of ``bimvox watch``: obstruction files that change by a script, and the resulting output."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.frozen.digest import digest_of, digest_of_document
from benchmarks.frozen.record import Recorded
from benchmarks.frozen.workshop import Workshop, store_of

Boxes = dict[str, tuple[float, ...]]
"""Obstructions by name: lowest and highest corner, metres."""
OBSTRUCTIONS = "obstructions.json"

_CRATE = (6.4, 2.6, 5.0, 7.0, 3.2, 6.4)
CHANGES: dict[str, tuple[Boxes, ...]] = {
    "frame": (
        {"crate": _CRATE},  # blocks a column
        {"crate": _CRATE, "van": (0.4, 0.9, 3.2, 1.2, 1.7, 4.4)},  # and a beam
        {"van": (0.4, 0.9, 3.2, 1.2, 1.7, 4.4), "pallet": (2.0, -0.2, 3.0, 2.5, 0.3, 3.4)},  # at the place of a beam
        {},
    ),
    "hall": (
        {"crate": (6.9, 3.1, 2.0, 7.5, 3.8, 3.4)},  # blocks the western crane
        {"crate": (6.9, 3.1, 2.0, 7.5, 3.8, 3.4), "van": (28.3, 2.7, 2.0, 29.0, 3.4, 3.6)},  # and the eastern crane
        {"pallet": (30.1, 6.0, 0.0, 30.4, 6.3, 0.5)},  # at the place of a column
        {},
    ),
    "yard": ({"crate": (22.0, 9.0, 4.0, 23.0, 16.0, 9.0)}, {"pallet": (25.0, 12.0, 0.0, 26.0, 13.0, 1.0)}, {}),
}
"""Successive contents of the obstruction file. The yard is watched with the shipped policy."""


def watched(workshop: Workshop, name: str, search: bool) -> Recorded:
    """Check every content of the file once, each in a separate process."""
    folder = workshop.copy_of(workshop.planned(name, search=search), f"watch-{name}")
    chosen = ("--policy", "none") if search else ()
    options = (OBSTRUCTIONS, "--site", f"{name}.site.toml", "-o", f"{name}.mcap", "--once", *chosen)
    recorded: Recorded = {}
    for number, boxes in enumerate(CHANGES[name], 1):
        put(folder / OBSTRUCTIONS, boxes)
        told = workshop.documents(folder, "watch", *options, store=store_of(name), codes=(0, 1))
        recorded[f"--json {number}"] = digest_of_document(told)
    return recorded | _logs_of(folder)


def simulated(workshop: Workshop, name: str) -> Recorded:
    """Execute a plan with a manual clock; see ``carried_out``."""
    folder = workshop.copy_of(workshop.planned(name, search=True), f"simulated-{name}")
    text = workshop.start([sys.executable, "-m", "benchmarks.frozen.carried_out", name], folder)
    return {"--json": digest_of_document(json.loads(text))} | _logs_of(folder)


def put(file: Path, boxes: Boxes) -> None:
    """Write an obstruction file."""
    entries = [{"id": name, "box": {"min": corners[:3], "max": corners[3:]}} for name, corners in boxes.items()]
    file.write_text(json.dumps(_file_of(entries)))


def _file_of(entries: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {"version": 1, "unit": "m", "obstructions": list(entries)}


def _logs_of(folder: Path) -> Recorded:
    return {path.name: digest_of(path, path.name) for path in sorted(folder.glob("*.mcap"))}
