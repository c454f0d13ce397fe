"""Files that a page puts into the folder: of known kinds, whole, inside, and over no other file."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.studio.app import Studio, application
from starlette.testclient import TestClient

TOKEN = "a-token"


class Sender:
    """A page that sends files."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.client = TestClient(application(Studio(folder, TOKEN), 8000), base_url="http://127.0.0.1:8000")

    def send(self, path: str, content: bytes, token: str = TOKEN, **asked: str) -> Any:
        headers = {"X-Bimvox-Token": token}
        return self.client.post("/api/upload", params={"path": path, **asked}, content=content, headers=headers)


@pytest.fixture
def sender(tmp_path: Path) -> Sender:
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    return Sender(folder)


def test_a_file_is_there_whole_and_nothing_else(sender: Sender):
    content = b"ISO-10303-21;" * 100_000
    answer = sender.send("sub/house.ifc", content)
    assert (answer.status_code, answer.json()) == (200, {"path": "sub/house.ifc"})
    assert (sender.folder / "sub" / "house.ifc").read_bytes() == content
    assert [path.name for path in sender.folder.rglob("*") if path.is_file()] == ["house.ifc"]


def test_another_file_is_replaced_only_by_who_has_seen_it(sender: Sender):
    sender.send("a.site.toml", b"one")
    assert sender.send("a.site.toml", b"one").status_code == 200, "the same"
    answer = sender.send("a.site.toml", b"two")
    assert answer.status_code == 409
    assert answer.json()["error"] == "a.site.toml is there already, with another content"
    assert answer.json()["sha256"] == hashlib.sha256(b"one").hexdigest()
    assert sender.send("a.site.toml", b"two", over="0" * 64).status_code == 409
    assert (sender.folder / "a.site.toml").read_bytes() == b"one"
    assert sender.send("a.site.toml", b"two", over=answer.json()["sha256"]).status_code == 200
    assert (sender.folder / "a.site.toml").read_bytes() == b"two"


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("../a.ifc", "outside the folder"),
        ("/tmp/a.ifc", "outside the folder"),
        ("a.exe", "not of a kind that bimvox reads"),
        ("a.html", "not of a kind that bimvox reads"),
        ("ifc", "not of a kind that bimvox reads"),
        (".a.ifc", "no name for a file here"),
        (".git/a.ifc", "no name for a file here"),
        ("a\nb.ifc", "no name for a file here"),
        ("none/a.ifc", "there is no folder"),
        ("", "no file is named"),
        (".", "no file is named"),
    ],
)
def test_what_is_no_file_of_the_folder_is_refused(sender: Sender, path: str, said: str):
    answer = sender.send(path, b"x")
    assert answer.status_code == 400
    assert said in answer.json()["error"] or path == "."
    assert [found for found in sender.folder.rglob("*") if found.is_file()] == []


@pytest.mark.skipif(sys.platform == "win32", reason="links need a right there")
@pytest.mark.parametrize("to", ["there.ifc", "new.ifc"])
def test_a_link_out_of_the_folder_is_refused(sender: Sender, to: str):
    outside = sender.folder.parent
    (outside / "there.ifc").write_bytes(b"mine")
    (sender.folder / "a.ifc").symlink_to(outside / to)
    (sender.folder / "out").symlink_to(outside)
    for path in ("a.ifc", "out/b.ifc"):
        answer = sender.send(path, b"theirs", over=hashlib.sha256(b"mine").hexdigest())
        assert answer.status_code == 400
        assert "outside the folder" in answer.json()["error"]
    assert sorted(path.name for path in outside.iterdir()) == ["folder", "there.ifc"]
    assert (outside / "there.ifc").read_bytes() == b"mine"


def test_what_is_too_large_is_refused_before_it_is_written(sender: Sender, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("bimvox_pipeline.studio.app.MOST_BYTES", 1 << 20)
    answer = sender.send("a.ifc", b"x" * ((1 << 20) + 1))
    assert answer.status_code == 413
    assert "larger than 1 MiB" in answer.json()["error"]
    assert [path for path in sender.folder.rglob("*") if path.is_file()] == []


def test_nobody_without_the_token_sends_files(sender: Sender):
    assert sender.send("a.ifc", b"x", token="").status_code == 403
    assert not (sender.folder / "a.ifc").exists()
