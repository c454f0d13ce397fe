"""A studio that serves a folder, in a process of its own, and its page in a browser."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

WAIT_S = 180
"""A plan takes many times as long on a machine with other work."""
ENVIRONMENT = os.environ | {"PYTHONUNBUFFERED": "1"}


@contextmanager
def served(folder: Path, errors: IO[str] | None = None) -> Iterator[str]:
    """Yield the address of `bimvox studio` in a folder; it ends with the block. What it says goes to ``errors``."""
    command = [sys.executable, "-m", "bimvox_cli", "studio", str(folder), "--no-browser", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=ENVIRONMENT)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line, "the studio ended before it was ready"
        yield json.loads(line)["url"]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)


class Studio:
    """An open studio, and what it did."""

    def __init__(self, page: Any, folder: Path) -> None:
        self.page = page
        self.folder = folder
        self.complaints: list[str] = []
        page.set_default_timeout(WAIT_S * 1000)
        page.on("console", self._hear)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def _hear(self, said: Any) -> None:
        # A refusal is shown as a sentence; the browser also notes its status.
        if said.type in ("error", "warning") and "the server responded with a status of 4" not in said.text:
            self.complaints.append(said.text)

    def wait(self, condition: str) -> None:
        """Wait for a JavaScript condition, evaluated from here, because the page forbids evaluation."""
        deadline = time.monotonic() + WAIT_S
        while not self.page.evaluate(f"() => Boolean({condition})"):
            assert time.monotonic() < deadline, f"never: {condition}"
            self.page.wait_for_timeout(30)

    def settled(self) -> None:
        """Wait until the server has answered about the set-up that is shown."""
        self.wait("window.studio.answer && !window.studio.trying.busy && !window.studio.trying.next")

    def setup(self) -> Any:
        return self.page.evaluate("() => window.studio.setup")

    def base(self) -> list[float]:
        return list(self.setup()["cranes"][0]["base_m"])

    def saved(self, name: str = "hall.site.toml") -> dict[str, Any]:
        return tomllib.loads((self.folder / name).read_text())

    def save(self) -> None:
        self.page.keyboard.press("Control+s")
        self.wait("!window.studio.isChanged")

    def middle(self, selector: str) -> tuple[float, float]:
        box = self.page.locator(selector).bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, selector: str, dx_m: float, dy_m: float, *, alt: bool = False) -> None:
        """Drag a handle by metres."""
        scale = self.page.evaluate("() => window.studio.drawing.view.scale")
        x, y = self.middle(selector)
        self.page.mouse.move(x, y)
        if alt:
            self.page.keyboard.down("Alt")
        self.page.mouse.down()
        self.page.mouse.move(x + dx_m / scale, y - dy_m / scale, steps=5)
        assert self.page.locator(".dimension").count() > 0
        self.page.mouse.up()
        if alt:
            self.page.keyboard.up("Alt")
        self.settled()
