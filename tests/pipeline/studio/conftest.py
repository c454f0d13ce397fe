"""Studios that do not collect garbage when they open a site."""

from __future__ import annotations

from types import SimpleNamespace

import pytest


@pytest.fixture(autouse=True)
def _is_quick(monkeypatch: pytest.MonkeyPatch) -> None:
    # In a process with all modules of the tests, a collection takes longer than opening a site.
    nothing = SimpleNamespace(unfreeze=lambda: None, collect=lambda: None, freeze=lambda: None)
    monkeypatch.setattr("bimvox_pipeline.studio.studio.gc", nothing)
