"""The main commands on every system; on Linux they run in an imitation of Windows (``support/elsewhere``)."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from bimvox_pipeline.site import init

from bimvox.progress import SilentProgress

ROOT = Path(__file__).parents[1]
ELSEWHERE = Path(__file__).parent / "support" / "elsewhere"
ACTS = """
import os, sys
from bimvox_cli.main import run
assert not (sys.platform == "linux" and hasattr(os, "fork"))
for line in open("acts.txt", encoding="utf-8"):
    arguments = line.split()
    code = run([*arguments, "-q"])
    print(code, *arguments)
    assert code == 0, line
"""
LINES = """
voxelize frame.ifc -o grid.zarr.zip
voxelize frame.ifc -o grid.zarr.zip
inspect grid.zarr.zip
init frame.ifc -o frame.site.toml
plan frame.site.toml --policy none -o frame.mcap
plan frame.site.toml -o frame.mcap
verify frame.mcap --site frame.site.toml
inspect frame.mcap
export frame.mcap --to csv -o frame.csv
export frame.mcap --to glb -o frame.glb
report frame.mcap -o frame.report.html
render frame.mcap --size 200x150 -o frame.png
render frame.mcap --no-proof -o frame.html
watch none.json --site frame.site.toml -o frame.mcap --once
watch truck.json --site frame.site.toml -o frame.mcap --once
verify frame.mcap
sweep sweep.toml -o runs --jobs 1
"""
NOTHING = '{"version": 1, "unit": "m", "obstructions": []}'
TRUCK = """{"version": 1, "unit": "m", "obstructions": [
{"id": "Lkw-ü", "box": {"min": [-3, -3, 0], "max": [-2, -2, 1]}}]}"""
SWEEP = 'sites = ["frame.site.toml"]\npolicy = "none"\n'


def _environment(folder: Path) -> dict[str, str]:
    """Return the environment; on Linux one in which texts are ASCII wherever no encoding is named."""
    if not sys.platform.startswith("linux"):
        return {**os.environ, "BIMVOX_POLICIES": str(folder / "policies")}
    kept = {key: os.environ[key] for key in ("PATH", "HOME", "NUMBA_CACHE_DIR") if key in os.environ}
    return {
        **kept,
        "LC_ALL": "C",
        "PYTHONCOERCECLOCALE": "0",
        "PYTHONUTF8": "0",
        "PYTHONIOENCODING": "cp1252",
        "PYTHONPATH": str(ELSEWHERE),
        "BIMVOX_POLICIES": str(folder / "policies"),
    }


def _python(code: str, folder: Path) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=_environment(folder),
        capture_output=True,
        check=False,
    )


@pytest.mark.slow
def test_the_main_commands_run_where_nothing_is_posix(tmp_path: Path) -> None:
    shutil.copy(ROOT / "sample_models" / "frame.ifc", tmp_path / "frame.ifc")
    for name, text in (("acts.txt", LINES.strip()), ("none.json", NOTHING), ("truck.json", TRUCK)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    done = _python(ACTS, tmp_path)
    assert done.returncode == 0, (done.stdout + done.stderr).decode("utf-8", "replace")
    assert len(done.stdout.splitlines()) >= len(LINES.strip().splitlines())
    assert not list(tmp_path.glob(".bimvox-*"))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="imitates Windows on Linux")
@pytest.mark.parametrize(
    ("module", "code", "refused"),
    [
        ("bimvox.x", "import fcntl", "No module named 'fcntl'"),
        ("bimvox.x", "import os; os.open('file', os.O_RDONLY)", "without O_BINARY"),
        ("bimvox.x", "import os; os.open('.', os.O_RDONLY)", "Permission denied"),
        ("bimvox.x", "import os; kept = open('file'); os.replace('other', 'file')", "being used"),
        ("bimvox.x", "import os; os.fork()", "no attribute 'fork'"),
        ("other", "import fcntl", ""),
        ("bimvox.x", "import os; os.replace('other', 'file')", ""),
    ],
)
def test_the_imitation_refuses_what_windows_refuses(tmp_path: Path, module: str, code: str, refused: str) -> None:
    for name in ("file", "other"):
        (tmp_path / name).write_text("x", encoding="ascii")
    done = _python(f"exec({code!r}, {{'__name__': {module!r}}})", tmp_path)
    assert refused in done.stderr.decode()
    assert (done.returncode == 0) == (not refused)


def test_a_model_on_another_drive_is_named_by_its_whole_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def another_drive(*_: object) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    model = shutil.copy(ROOT / "sample_models" / "frame.ifc", tmp_path)
    monkeypatch.setattr("bimvox.files.os.path.relpath", another_drive)
    document = init(Path(model), tmp_path / "frame.site.toml", progress=SilentProgress())
    assert tomllib.loads(Path(document["site"]).read_text("utf-8"))["model"]["path"] == Path(model).resolve().as_posix()
