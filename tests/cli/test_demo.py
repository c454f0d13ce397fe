"""``bimvox demo``: the main job on the sample of the package; here the small frame stands for it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from bimvox_cli.main import run

FRAME = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
MADE = {
    "prefab.ifc",
    "prefab.zarr.zip",
    "prefab.site.toml",
    "prefab.site.svg",
    "prefab.mcap",
    "prefab.png",
    "prefab.html",
}


@pytest.fixture(autouse=True)
def _small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bimvox_pipeline.demo.sample", FRAME.read_bytes)
    monkeypatch.setenv("BIMVOX_SIZE", "120x80")
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
def test_every_step_is_printed_and_the_end_says_where_to_look(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["demo"]) == 0
    out = capsys.readouterr().out
    folder = tmp_path / "demo-output"
    assert {file.name for file in folder.iterdir()} == MADE
    steps = [line.split()[2] for line in out.splitlines() if line.startswith("$ bimvox ")]
    assert steps == ["voxelize", "init", "plan", "verify", "render", "render"]
    page = folder / "prefab.html"
    assert out.splitlines()[-2:] == [f"  {Path('demo-output') / page.name}", f"  {page.as_uri()}"]
    for name in ("prefab.mcap", "prefab.png", "prefab.site.toml", "prefab.site.svg"):
        assert str(Path("demo-output") / name) in out.split("The lift log:")[1]


@pytest.mark.slow
@pytest.mark.parametrize("variable", [None, "BIMVOX_JSON"])
def test_as_json_it_is_one_document_that_of_plan(
    variable: str | None, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if variable:
        monkeypatch.setenv(variable, "1")
    assert run(["demo", "-o", "there/deeper", *([] if variable else ["--json"])]) == 0
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert document["log"] == str(Path("there/deeper/prefab.mcap"))
    assert document["verified"]
    assert err == ""


def test_a_folder_that_cannot_be_made_is_one_clear_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken").write_text("a file", encoding="ascii")
    assert run(["demo", "-o", "taken", "--json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert "taken" in document["error"]["message"]


def test_ctrl_c_in_a_step_ends_the_demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[str] = []

    def interrupted(*_: object, **__: object) -> None:
        begun.append("voxelize")
        raise KeyboardInterrupt

    monkeypatch.setattr("bimvox_pipeline.voxelize.voxelize", interrupted)
    monkeypatch.setattr("bimvox_pipeline.site.init", lambda *_, **__: begun.append("init"))
    assert run(["demo", "-o", str(tmp_path / "out"), "-q"]) == 130
    assert begun == ["voxelize"]
