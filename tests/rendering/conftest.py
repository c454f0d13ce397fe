"""A real browser, headless, for tests marked ``browser``."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from opened_pages import passed_proof, tiny_source
from seen_pages import Seen, show

ARGUMENTS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Options for software rendering, and for no network connections of the browser itself."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip browser tests unless a marker expression selects them: not every machine has a browser."""
    if "browser" in config.option.markexpr:
        return
    left_out = [item for item in items if item.get_closest_marker("browser")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Return Chromium, from ``BIMVOX_BROWSER`` or the search path."""
    found = os.environ.get("BIMVOX_BROWSER") or shutil.which("chromium") or shutil.which("google-chrome")
    if found is None:
        pytest.fail("no browser is here: install chromium, or set BIMVOX_BROWSER to one")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=found, args=list(ARGUMENTS))
        yield chromium
        chromium.close()


@pytest.fixture
def seen(browser: Any, tmp_path: Path) -> Iterator[Seen]:
    """Return the page of the tiny plan; afterwards it must have complained of nothing and requested nothing."""
    seen = show(browser, tmp_path, tiny_source(proof=passed_proof()), reduced_motion="reduce")
    yield seen
    assert seen.complaints == []
    assert len(seen.requests) == 1  # the page itself
    seen.page.context.close()
