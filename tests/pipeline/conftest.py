"""A small planned site: the sample frame at coarse cells."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from planned_frame import copy_to, planned
from rough_search import models_are_read_once  # noqa: F401  (a fixture)

from bimvox.policy import store as policies


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Use a policy store that belongs to the tests."""
    folder = tmp_path_factory.mktemp("policies")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BIMVOX_POLICIES", str(folder))
        yield folder


@pytest.fixture(scope="session")
def good_frame() -> Path:
    """Return the folder of the planned frame, planned before a test changes how plans are made."""
    return planned()


@pytest.fixture
def site_folder(store: Path, good_frame: Path, tmp_path: Path) -> Path:
    """Return a folder with the planned frame's model, site file and log, which the test may change."""
    return copy_to(tmp_path)


@pytest.fixture
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty policy store for one test."""
    folder = tmp_path / "own-store"
    monkeypatch.setenv(policies.STORE_VARIABLE, str(folder))
    return folder
