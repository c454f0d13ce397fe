"""A page that follows a log: what is written when, and in a real browser how an open page follows."""

from __future__ import annotations

import dataclasses
import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.render.follow import follow
from log_building import tiny_log
from opened_pages import Opened

from bimvox.errors import FileError, InputError
from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress
from bimvox.records.lift import Method

VERSION = "document.querySelector('meta[name=bimvox-live]').dataset.version"


def write_revision(file: Path, number: int, **changed: Any) -> None:
    """Replace a whole log, as a watch does."""
    log = tiny_log(crane=True)
    if changed:
        lifts = tuple(dataclasses.replace(lift, **changed) if lift.order == 2 else lift for lift in log.plan.lifts)
        log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, lifts=lifts))
    part = file.with_suffix(".part")
    with part.open("wb") as stream:
        write_log(stream, dataclasses.replace(log, revision=number))
    part.replace(file)


def news_of(script: Path) -> dict[str, Any]:
    text = script.read_text()
    assert text.startswith("window.bimvoxLive?.(")
    return json.loads(text[len("window.bimvoxLive?.(") : -len(");\n")])


def following(log: Path, out: Path, stop: threading.Event) -> Iterator[dict[str, Any]]:
    return follow(log, out, proven=False, progress=SilentProgress(), stop=stop)


def test_the_page_is_written_again_with_its_log(tmp_path: Path):
    log, out, stop = tmp_path / "tiny.mcap", tmp_path / "tiny.html", threading.Event()
    write_revision(log, 0)
    pages = following(log, out, stop)
    first = next(pages)
    assert (first["event"], first["revision"], first["revisions"]) == ("page", 0, 1)
    opened = Opened(out.read_bytes())
    assert f'content="tiny.live.js" data-version="{first["sha256"]}"' in opened.text
    assert news_of(tmp_path / "tiny.live.js") == {"version": first["sha256"], "revision": 0, "ended": False}
    write_revision(log, 1, method=Method.POLICY)
    second = next(pages)
    assert (second["event"], second["revision"]) == ("page", 1)
    assert second["sha256"] != first["sha256"]
    assert second["latency_ms"] > 0
    assert Opened(out.read_bytes()).document["revisions"][-1]["number"] == 1
    assert news_of(tmp_path / "tiny.live.js")["version"] == second["sha256"]
    stop.set()
    assert list(pages) == []
    assert news_of(tmp_path / "tiny.live.js") == {"version": second["sha256"], "revision": 1, "ended": True}


def test_a_log_that_cannot_be_shown_leaves_the_last_page(tmp_path: Path):
    log, out, stop = tmp_path / "tiny.mcap", tmp_path / "tiny.html", threading.Event()
    write_revision(log, 0)
    pages = following(log, out, stop)
    next(pages)
    before = out.read_bytes()
    (tmp_path / "broken").write_bytes(log.read_bytes()[:2000])
    (tmp_path / "broken").replace(log)
    rejected = next(pages)
    assert rejected["event"] == "rejected"
    assert rejected["message"]
    assert out.read_bytes() == before
    stop.set()
    list(pages)


def test_a_log_may_come_later(tmp_path: Path):
    log, out, stop = tmp_path / "tiny.mcap", tmp_path / "tiny.html", threading.Event()
    pages = following(log, out, stop)
    threading.Timer(0.3, write_revision, (log, 0)).start()
    assert next(pages)["revision"] == 0
    stop.set()
    list(pages)


def test_proof_and_remarks_are_made_once_a_revision(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    log, stop = tmp_path / "tiny.mcap", threading.Event()
    write_revision(log, 0)
    write_revision(tmp_path / "tiny.r0000.mcap", 0)
    proofs, remarks = [], []
    from bimvox_pipeline.render import revisions as page_revisions

    from bimvox.remarks import remarks as remarks_module

    made = page_revisions.prove
    monkeypatch.setattr(page_revisions, "prove", lambda *given: proofs.append(given) or made(*given))
    found = remarks_module.remarks_of
    monkeypatch.setattr(remarks_module, "remarks_of", lambda *given: remarks.append(given) or found(*given))
    pages = follow(log, tmp_path / "tiny.html", progress=SilentProgress(), stop=stop)
    next(pages)
    assert len(proofs) == 1
    assert len(remarks) == 1
    write_revision(log, 1, method=Method.POLICY)
    remarks.clear()  # a log holds the remarks too
    assert next(pages)["revisions"] == 2
    assert len(proofs) == 2
    assert len(remarks) == 1
    stop.set()
    list(pages)


def test_only_a_page_follows(tmp_path: Path):
    log = tmp_path / "tiny.mcap"
    write_revision(log, 0)
    with pytest.raises(InputError, match="only a page can follow a log"):
        next(following(log, tmp_path / "x.png", threading.Event()))
    with pytest.raises(FileError):
        next(following(log, tmp_path / "none" / "x.html", threading.Event()))


def test_a_page_that_does_not_follow_makes_no_requests(tmp_path: Path):
    from bimvox_pipeline.render.revisions import page_of_log

    write_revision(tmp_path / "tiny.mcap", 0)
    text = page_of_log(tmp_path / "tiny.mcap", proven=False, progress=SilentProgress()).decode()
    assert '<meta name="bimvox-live"' not in text
    policy = text.split('Content-Security-Policy" content="')[1].split('"')[0]
    assert "'self'" not in policy


@pytest.mark.browser
def test_an_open_page_follows_and_continues_where_it_was(browser: Any, tmp_path: Path):
    log, out, stop = tmp_path / "tiny plan.mcap", tmp_path / "tiny plan.html", threading.Event()
    write_revision(log, 0)
    pages = following(log, out, stop)
    first = next(pages)
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    complaints: list[str] = []
    page.on("console", lambda said: complaints.append(said.text) if said.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))

    def shows(news: dict[str, Any]) -> str:
        return f"{VERSION} === '{news['sha256']}' && window.page?.live"

    def holds(condition: str) -> bool:
        """Return False while the page reloads itself."""
        from playwright.sync_api import Error

        try:
            return bool(page.evaluate(f"() => Boolean({condition})"))
        except Error as error:
            assert "navigation" in str(error)
            return False

    def wait(condition: str) -> None:
        deadline = time.monotonic() + 60
        while not holds(condition):
            assert time.monotonic() < deadline, f"never: {condition}"
            page.wait_for_timeout(50)

    page.goto(out.as_uri())
    wait("window.page?.live?.state === 'heard'")
    assert page.inner_text("#follow") == "● live"
    page.evaluate("() => { page.seek(42); page.setSpeed(20); page.choose(2); page.setLayer('voxels', true); }")
    page.evaluate("() => { page.camera.azimuth = 123; }")
    page.click("#tab-remarks")
    write_revision(log, 1, method=Method.POLICY)
    second = next(pages)
    wait(shows(second))
    assert page.evaluate("() => page.plan.revision.number") == 1
    assert page.evaluate("() => [page.time, page.speed, page.chosen, page.layers.voxels, page.camera.azimuth]") == [
        42, 20, 2, True, 123,
    ]  # fmt: skip
    assert page.is_visible("#panel-remarks")
    assert "Revision 1 loaded" in page.inner_text("#live")
    # While paused, it keeps what it shows until it is resumed.
    page.click("#follow")
    write_revision(log, 2)
    third = next(pages)
    page.wait_for_timeout(2500)
    assert page.evaluate("() => page.plan.revision.number") == 1
    assert page.inner_text("#follow") == "live: paused"
    page.click("#follow")
    wait(shows(third))
    stop.set()
    list(pages)
    wait("window.page.live.state === 'ended'")
    assert page.inner_text("#follow") == "no longer live"
    assert first["sha256"] != second["sha256"]
    assert complaints == []
    page.close()
