"""Studios whose opened sites cost no more than they must: models are read once, nothing is collected."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from rough_search import read_once


@pytest.fixture(autouse=True)
def _is_quick(monkeypatch: pytest.MonkeyPatch) -> None:
    read_once(monkeypatch)
    # In a process with all modules of the tests, a collection takes longer than opening a site.
    nothing = SimpleNamespace(unfreeze=lambda: None, collect=lambda: None, freeze=lambda: None)
    monkeypatch.setattr("bimvox_pipeline.studio.app.gc", nothing)
