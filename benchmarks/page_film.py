"""A film of the page, and pictures of studio and report, for the docs: the sample in a real, headless browser.

``make film``: plans and proves the sample, renders its page, and photographs it at even times. It needs Playwright and
a Chromium, whose path ``BIMVOX_BROWSER`` may give. The frames become one animated WebP.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image

SIZE_PX = (1500, 900)
SHOWN_PX = (900, 540)
FRAME_MS = 250
LAST_MS = 2_000
WAIT_MS = 60_000
SETTLED_MS = 20_000
GL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


@contextmanager
def browsed(address: str) -> Iterator[Any]:
    """Open an address in a headless browser, which draws without a GPU."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=os.environ.get("BIMVOX_BROWSER"), args=GL)
        page = browser.new_page(viewport=dict(zip(("width", "height"), SIZE_PX, strict=True)))
        page.goto(address)
        yield page
        browser.close()


def photographed(html: Path, frames: int) -> list[Image.Image]:
    """Return the page as pictures, at even times of the plan."""
    with browsed(html.resolve().as_uri()) as page:
        page.wait_for_function("() => document.getElementById('time')?.max > 1", timeout=WAIT_MS)
        return [_at(page, n / (frames - 1)) for n in range(frames)]


def of_the_studio(site: Path) -> Image.Image:
    """Return the studio with a site open, as it says what the crane carries."""
    program = "import sys; from bimvox_cli.main import run; sys.exit(run())"
    command = [sys.executable, "-c", program, "studio", str(site), "--no-browser", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as studio:
        assert studio.stdout is not None
        try:
            with browsed(json.loads(studio.stdout.readline())["url"]) as page:
                page.get_by_text("can be lifted").first.wait_for(timeout=WAIT_MS)
                page.wait_for_timeout(SETTLED_MS)
                return _picture(page)
        finally:
            studio.terminate()


def _at(page: Any, share: float) -> Image.Image:
    page.evaluate(
        "(share) => { const s = document.getElementById('time'); s.value = Number(s.min) + share * (s.max - s.min);"
        " s.dispatchEvent(new Event('input')); }",
        share,
    )
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return _picture(page)


def _picture(page: Any) -> Image.Image:
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    return picture.resize(SHOWN_PX, Image.Resampling.LANCZOS)


def main() -> None:
    """Write the film, and the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("html", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--studio", type=Path, nargs=2, metavar=("SITE", "PICTURE"), help="photograph the studio, too")
    parser.add_argument("--report", type=Path, nargs=2, metavar=("HTML", "PICTURE"), help="photograph a report, too")
    given = parser.parse_args()
    if given.report:
        report, picture = given.report
        with browsed(report.resolve().as_uri()) as page:
            _picture(page).save(picture, quality=80, method=6)
    if given.studio:
        site, picture = given.studio
        of_the_studio(site).save(picture, quality=80, method=6)
    first, *others = photographed(given.html, given.frames)
    times = [FRAME_MS] * len(others) + [LAST_MS]
    first.save(given.out, save_all=True, append_images=others, duration=times, loop=0, quality=60, method=6)


if __name__ == "__main__":
    main()
