"""A search for set-ups that times few lifts and reads a model once: for tests of what becomes of a choice."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from bimvox_pipeline.studio import opened

from bimvox.bim.building import Building
from bimvox.bim.read import ReadOptions, read_building
from bimvox.library import site
from bimvox.library.set_up_search.search import Search
from bimvox.progress import Report

_LIFTS = 4


def time_few_lifts(patched: pytest.MonkeyPatch) -> None:
    """Time a few lifts of each set-up, as long as the patch lasts."""
    timed_s = Search.timed_s
    patched.setattr(
        Search, "timed_s", lambda search, crane, served, _=None, yard=None: timed_s(search, crane, served, _LIFTS, yard)
    )


def read_once(patched: pytest.MonkeyPatch) -> None:
    """Read each model once in a process of the tests, as :func:`read_model`, as long as the patch lasts."""
    for module in (site, opened):
        patched.setattr(module, "read_building", read_model)


def read_model(path: Path, options: ReadOptions | None = None, _: Report | None = None) -> Building:
    """Return a model, read once in a process of the tests: reading one starts a process of its own."""
    return _read(path.read_bytes(), path, options or ReadOptions())


@cache
def _read(_: bytes, path: Path, options: ReadOptions) -> Building:
    return read_building(path, options)
