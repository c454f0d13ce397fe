"""Code that the command line names, and ``bimvox plan`` with it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from bimvox_cli.main import run
from bimvox_pipeline.named_code import named_code, named_order

from bimvox.errors import InputError, PolicyError

CODE = """
from dataclasses import dataclass

print("imported")
number = 5


@dataclass
class Planner:
    top: int

    def __call__(self, start, goal, space):
        print("asked")
        high = space.shape[2] - self.top
        return [start, (*start[:2], high), (*goal[:2], high), goal]


planner = Planner(6)


def order(parts):
    done = []
    while len(done) < len(parts):
        done.append(next(one.id for one in parts if one.id not in done and set(one.after) <= set(done)))
    return done


def values(seen):
    return [4] * len(seen)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "brought.py").write_text(CODE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "brought", raising=False)
    return tmp_path


def test_code_of_a_module_or_a_file_is_found_and_keeps_stdout_clean(folder: Path, capsys: pytest.CaptureFixture[str]):
    path = list(sys.path)
    assert named_code("brought:order", "--order").__module__ == "brought"
    assert named_code("brought.py:planner", "--paths").top == 6
    assert named_code(f"{folder}/brought.py:number", "x") == 5
    assert sys.path == path
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("brought", "not module:name"),
        ("brought:", "not module:name"),
        (":order", "not module:name"),
        ("brought:nothing", "the module has no function 'nothing'"),
        ("nowhere_at_all:order", "cannot be imported: ModuleNotFoundError"),
        ("nowhere.py:order", "cannot be imported: FileNotFoundError"),
        ("broken.py:order", "cannot be imported: SyntaxError"),
    ],
)
def test_what_is_not_there_is_an_error_with_a_hint(folder: Path, text: str, said: str):
    (folder / "broken.py").write_text("def (:")
    with pytest.raises(InputError, match=said) as caught:
        named_code(text, "--paths")
    assert caught.value.message.startswith(f"--paths {text}")
    assert caught.value.hint is not None
    with pytest.raises(PolicyError):
        named_code(text, "policy", PolicyError)


def test_a_file_of_python_never_takes_the_place_of_a_module(folder: Path):
    (folder / "json.py").write_text("order = len")
    assert named_code("json.py:order", "--order") is len
    assert sys.modules["json"] is json


def test_an_order_is_a_file_of_ids_or_a_function(folder: Path):
    (folder / "order.txt").write_text("a\n\n b \n")
    (folder / "order.json").write_text('["b", "a"]')
    (folder / "bad.json").write_text('["b",')
    assert named_order("order.txt") == ["a", "b"]
    assert named_order("order.json") == ["b", "a"]
    assert callable(named_order("brought:order"))
    with pytest.raises(InputError, match=r"bad\.json: not a JSON list"):
        named_order("bad.json")
    with pytest.raises(InputError, match=r"none\.txt"):
        named_order("none.txt")


def test_a_site_is_planned_with_planner_order_and_policy_and_proven(
    site_folder: Path, folder: Path, capsys: pytest.CaptureFixture[str]
):
    log = folder / "mine.mcap"
    words = ["--paths", "brought.py:planner", "--order", "brought:order", "--policy", "brought:values", "--json"]
    assert run(["plan", str(site_folder / "frame.site.toml"), "-o", str(log), *words]) == 0
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert "asked" in printed.err
    found = [one for one in document["lifts"] if one["method"] == "planner"]
    assert found
    assert {one["planner"] for one in found} == {"brought:Planner"}
    assert document["figures"]["shares"]["planner"] == pytest.approx(len(found) / len(document["lifts"]), abs=1e-6)
    assert document["policy"]["external"] == ["brought:Planner", "brought:values"]
    for one in document["lifts"]:
        assert (one["method"] == "planner") == ("planner_note" not in one)
    assert run(["verify", str(log), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verified"]
    assert run(["inspect", str(log), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)["lifts"]
    assert [one["method"] for one in shown] == [one.get("planner") or one["method"] for one in document["lifts"]]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--paths", "brought:nothing"], "--paths brought:nothing: the module has no function 'nothing'"),
        (["--paths", "brought:number"], "paths is 5"),
        (["--policy", "brought:number"], "policy is 5"),
        (["--order", "brought:values"], "order: no part has the id 4"),
        (["--paths", "brought:planner", "--paths-limit", "-1"], "--paths-limit"),
        (["--paths", "brought:planner", "other.site.toml"], "--paths works with one site only"),
    ],
)
def test_wrong_code_ends_with_a_sentence_and_code_2(
    site_folder: Path, folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
):
    assert run(["plan", str(site_folder / "frame.site.toml"), *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert "Traceback" not in told
