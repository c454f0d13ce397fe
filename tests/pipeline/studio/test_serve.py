"""The studio's server: its socket and threads, saves at the same moment, and pages that leave."""

from __future__ import annotations

import http.client
import json
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
import uvicorn
from bimvox_pipeline.studio.opened import alone_in
from bimvox_pipeline.studio.serve import serve
from planned_frame import copy_to
from studios import served


def test_an_answer_is_sent_at_once_and_a_picture_does_not_hold_up_a_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Any] = []

    def run(_: uvicorn.Server, sockets: list[socket.socket]) -> None:
        with socket.create_connection(sockets[0].getsockname()), sockets[0].accept()[0] as accepted:
            seen.append(accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        seen.append(sys.getswitchinterval())

    usual_s = sys.getswitchinterval()
    monkeypatch.setattr(uvicorn.Server, "run", run)
    try:
        serve(tmp_path, browser=False, ready=lambda _: None)
    finally:
        sys.setswitchinterval(usual_s)
    no_delay, switch_s = seen
    assert no_delay
    assert switch_s < usual_s


class Pages:
    """What several pages ask of a studio over real connections, as (status, JSON)."""

    def __init__(self, address: str) -> None:
        self.host = urlsplit(address).netloc
        self.token = parse_qs(urlsplit(address).query)["token"][0]

    def send(self, path: str, asked: dict[str, Any]) -> tuple[int, dict[str, Any]]:
        with closing(http.client.HTTPConnection(self.host, timeout=60)) as line:
            line.request("POST", path, json.dumps(asked), {"X-Bimvox-Token": self.token})
            answer = line.getresponse()
            return answer.status, json.loads(answer.read())

    def together(self, path: str, *asked: dict[str, Any]) -> list[tuple[int, dict[str, Any]]]:
        """Ask several things at the same moment."""
        start, answers = threading.Barrier(len(asked)), [(0, dict[str, Any]())] * len(asked)

        def one(n: int) -> None:
            start.wait()
            answers[n] = self.send(path, asked[n])

        threads = [threading.Thread(target=one, args=(n,)) for n in range(len(asked))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return answers


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_to(tmp_path_factory.mktemp("together"))


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("said") / "stderr"


@pytest.fixture(scope="module")
def address(folder: Path, said: Path) -> Iterator[str]:
    with said.open("w") as errors, served(folder, errors) as found:
        yield found


def with_base(setup: dict[str, Any], x: float) -> dict[str, Any]:
    return {**setup, "cranes": [{**setup["cranes"][0], "base_m": [x, -4.0]}]}


def saves(pages: Pages, n: int) -> tuple[str, list[dict[str, Any]]]:
    """Two pages save what they opened at the same time, each with another place of the crane."""
    opened = pages.send("/api/open", {"path": "frame.site.toml"})[1]
    made = [with_base(opened["setup"], -5.0 - n - x / 4) for x in (1, 2)]
    asked = [{"path": opened["path"], "sha256": opened["sha256"], "setup": setup} for setup in made]
    return "/api/save", asked


def placings(pages: Pages, n: int) -> tuple[str, list[dict[str, Any]]]:
    """Two pages drop another obstruction each."""
    first = [{"id": f"start {n}", "min": [0, 0, 0], "max": [1, 1, 1]}]
    seen = pages.send("/api/state", {"path": "frame.site.toml"})[1]["obstructions_sha256"]
    asked_first = {"path": "frame.site.toml", "obstructions": first, "sha256": seen}
    begun = pages.send("/api/obstructions", asked_first)[1]
    made = [[*first, {"id": f"{n} {who}", "min": [2, 0, 0], "max": [3, 1, 1]}] for who in "ab"]
    asked = [{"path": "frame.site.toml", "sha256": begun["sha256"], "obstructions": boxes} for boxes in made]
    return "/api/obstructions", asked


@pytest.mark.parametrize("kind", [saves, placings])
def test_of_two_saves_at_the_same_moment_one_is_refused_and_gets_its_edit_back(
    address: str, folder: Path, kind: Callable[[Pages, int], Any]
) -> None:
    pages = Pages(address)
    for n in range(3):
        path, asked = kind(pages, n)
        answers = pages.together(path, *asked)
        assert sorted(status for status, _ in answers) == [200, 409], answers
        (refused,) = [n for n, (status, _) in enumerate(answers) if status == 409]
        key = "setup" if path == "/api/save" else "obstructions"
        assert answers[refused][1][key] == asked[refused][key]
        assert "changed since" in answers[refused][1]["error"]
        kept = asked[1 - refused][key]
        if key == "setup":
            opened = pages.send("/api/open", {"path": "frame.site.toml"})[1]
            assert opened["setup"]["cranes"][0]["base_m"] == kept["cranes"][0]["base_m"]
        else:
            written = json.loads((folder / "frame.obstructions.json").read_text())["obstructions"]
            assert [one["id"] for one in written] == [one["id"] for one in kept]


def test_of_two_new_files_of_a_name_at_the_same_moment_one_is_refused(address: str, folder: Path) -> None:
    pages = Pages(address)
    setup = pages.send("/api/open", {"path": "frame.site.toml"})[1]["setup"]
    asked = [{"path": "frame.site.toml", "name": "west", "setup": with_base(setup, -7.0 - n)} for n in range(3)]
    assert sorted(status for status, _ in pages.together("/api/variant", *asked)) == [200, 400, 400]
    assert (folder / "west.site.toml").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="a folder cannot be locked there")
def test_a_save_waits_for_another_studio_in_the_folder(address: str, folder: Path) -> None:
    pages, answers = Pages(address), []
    path, asked = saves(pages, 20)
    waiting = threading.Thread(target=lambda: answers.append(pages.send(path, asked[0])))
    with alone_in(folder):
        waiting.start()
        waiting.join(1.0)
        assert waiting.is_alive()
        site = folder / "frame.site.toml"
        site.write_text(site.read_text() + "# by another studio\n")
    waiting.join(60)
    assert answers[0][0] == 409
    assert site.read_text().endswith("# by another studio\n")


def test_a_page_that_leaves_costs_a_line(address: str, said: Path) -> None:
    pages = Pages(address)
    host, _, port = pages.host.partition(":")
    head = f"Host: {pages.host}\r\nX-Bimvox-Token: {pages.token}\r\n"
    body = json.dumps({"path": "frame.site.toml"})
    for request in (
        f"POST /api/save HTTP/1.1\r\n{head}Content-Length: 99999\r\n\r\n" + "{",
        f"POST /api/open HTTP/1.1\r\n{head}Transfer-Encoding: chunked\r\n\r\n3\r\n{{",
        f"POST /api/open HTTP/1.1\r\n{head}Content-Length: {len(body)}\r\n\r\n{body}",
        f"GET /page/frame.mcap?token={pages.token} HTTP/1.1\r\n{head}\r\n",
        "GET / HT",
    ):
        line = socket.create_connection((host, int(port)), timeout=30)
        line.sendall(request.encode())
        time.sleep(0.05)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # closed at once, unread
        line.close()
    with closing(socket.create_connection((host, int(port)), timeout=30)) as line:
        line.sendall(f"GET /page/frame.mcap?token={pages.token} HTTP/1.1\r\n{head}\r\n".encode())
        line.recv(2000)  # of an answer of some megabytes
    assert pages.send("/api/open", {"path": "frame.site.toml"})[0] == 200
    lines = said.read_text().splitlines()
    assert len(lines) <= 5, lines
    assert sum("closed its connection" in line for line in lines) == 2
    assert not any("Traceback" in line for line in lines)
