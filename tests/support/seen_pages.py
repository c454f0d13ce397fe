"""A page open in a real browser, for tests marked ``browser``."""

from __future__ import annotations

import io
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from bimvox.rendering.page.page import page_of
from bimvox.rendering.page.source import PageSource

WAIT_MS = 60_000
SHOWN_S = 10.0


class Seen:
    """An open page, and what it did."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.requests: list[str] = []
        page.set_default_timeout(WAIT_MS)
        page.on(
            "console", lambda said: self.complaints.append(said.text) if said.type in ("error", "warning") else None
        )
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

    def text(self, selector: str) -> str:
        return str(self.page.inner_text(selector))

    def terms(self, panel: str = "#panel-part") -> dict[str, str]:
        pairs = self.page.eval_on_selector_all(
            f"{panel} dt", "(terms) => terms.map((dt) => [dt.innerText, dt.nextElementSibling.innerText])"
        )
        return dict(pairs)

    def seek(self, seconds: float) -> None:
        self.page.evaluate(
            "(at) => { const s = document.getElementById('time'); s.value = at; s.dispatchEvent(new Event('input')); }",
            seconds,
        )
        self.drawn()

    def drawn(self) -> None:
        """Wait until the page has drawn its current state: it draws in the next frame, not at once."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def wait(self, condition: str) -> None:
        """Wait for a JavaScript condition, evaluated from here, because the page forbids evaluation."""
        deadline = time.monotonic() + WAIT_MS / 1000
        while not self.page.evaluate(f"() => Boolean({condition})"):
            assert time.monotonic() < deadline, f"never: {condition}"
            self.page.wait_for_timeout(30)

    def picture(self) -> np.ndarray:
        """Return the view as pixels, after it was drawn."""
        self.drawn()
        data = self.page.locator("#canvas").screenshot()
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)

    def shows(self, condition: Callable[[np.ndarray], bool]) -> bool:
        """Whether the view comes to look as the condition asks.

        A software compositor on a busy machine shows the earlier frame for a while after the page has drawn.
        """
        deadline = time.monotonic() + SHOWN_S
        while not condition(self.picture()):
            if time.monotonic() > deadline:
                return False
        return True

    def shows_same(self, picture: np.ndarray) -> bool:
        """Whether the view comes to be equal to an earlier picture, pixel by pixel."""
        return self.shows(lambda shown: shown.shape == picture.shape and bool((shown == picture).all()))

    def shows_other(self, picture: np.ndarray, *, by: int, pixels: int = 0) -> bool:
        """Whether more than ``pixels`` of the view come to differ from an earlier picture by more than ``by``."""
        return self.shows(lambda shown: bool((np.abs(shown - picture).max(axis=2) > by).sum() > pixels))


def show(browser: Any, folder: Path, source: PageSource, **context: Any) -> Seen:
    file = folder / "plan page.html"
    file.write_bytes(page_of(source))
    seen = Seen(browser.new_context(viewport={"width": 1280, "height": 720}, **context).new_page())
    seen.page.goto(file.as_uri())
    seen.wait("document.documentElement.dataset.drawn > 0")
    return seen


def contrast(seen: Seen, selector: str) -> float:
    """The contrast of text to its own background, as WCAG 2 has it."""
    style = "(at) => { const s = getComputedStyle(document.querySelector(at)); return [s.color, s.backgroundColor]; }"
    light = []
    for colour in seen.page.evaluate(style, selector):
        rgb = np.array([int(value) for value in re.findall(r"\d+", colour)[:3]]) / 255
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        light.append(float(linear @ [0.2126, 0.7152, 0.0722]))
    return (max(light) + 0.05) / (min(light) + 0.05)
