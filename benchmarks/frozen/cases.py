"""The cases: each runs the program and returns what is recorded of the files that it wrote."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.frozen.digest import digest_of, digest_of_document
from benchmarks.frozen.record import Recorded
from benchmarks.frozen.workshop import MODELS, Workshop

Case = Callable[[Workshop], Recorded]


def cases() -> dict[str, Case]:
    """Return all cases by name, in the order in which they run."""
    return {
        **{f"init-{name}": partial(_init, name=name) for name in MODELS},
        **{f"voxelize-{name}": partial(_voxelize, name=name) for name in MODELS},
        **{f"search-{name}": partial(_planned, name=name, search=True) for name in MODELS},
        **{f"policy-{name}": partial(_planned, name=name, search=False) for name in MODELS},
    }


def files_of(folder: Path, *names: str) -> Recorded:
    """Return what is recorded of files of a folder."""
    return {name: digest_of(folder / name, name) for name in names}


def _init(workshop: Workshop, name: str) -> Recorded:
    return files_of(workshop.begun(name), f"{name}.site.toml")


def _voxelize(workshop: Workshop, name: str) -> Recorded:
    folder, grid = workshop.copy_of(workshop.site(name), f"voxelize-{name}"), f"{name}.zarr.zip"
    (document,) = workshop.documents(folder, "voxelize", MODELS[name], "-o", grid)
    return files_of(folder, grid) | {"--json": digest_of_document(document)}


def _planned(workshop: Workshop, name: str, search: bool) -> Recorded:
    folder = workshop.planned(name, search=search)
    document = json.loads((folder / f"{name}.plan.json").read_text())
    return files_of(folder, f"{name}.mcap") | {"--json": digest_of_document(document)}
