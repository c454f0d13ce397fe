"""Searches for set-ups that time few lifts, and models that are read once: for tests of what becomes of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from bimvox_pipeline.studio import opened, saving

from bimvox.bim import read
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


@pytest.fixture(scope="module", autouse=True)
def models_are_read_once() -> Iterator[None]:
    """Read each model once in a process of the tests, in the tests next to the ``conftest.py`` that imports this."""
    with pytest.MonkeyPatch.context() as patched:
        for module in (read, site, opened, saving):
            patched.setattr(module, "read_building", read_model)
        yield


def read_model(path: Path, options: ReadOptions | None = None, _: Report | None = None) -> Building:
    """Return a model; an IFC file is read once in a process of the tests: reading one starts a process of its own."""
    if path.suffix.lower() != ".ifc":  # a mesh file may name others
        return read_building(path, options)
    content = path.read_bytes()
    known = content, path.name, options or ReadOptions()
    if known not in _READ:
        _READ[known] = read_building(path, options)
    return _READ[known]


_READ: dict[tuple[bytes, str, ReadOptions], Building] = {}
