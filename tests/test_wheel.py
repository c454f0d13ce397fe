"""The wheel, installed where the checkout cannot be imported, does the main job from another folder."""

from __future__ import annotations

import email
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OURS = {"bimvox", "bimvox_cli", "bimvox_pipeline"}
BUILD = "import sys; from setuptools import build_meta; print(build_meta.build_wheel(sys.argv[1]))"
MAIN_JOB = """
import importlib.metadata, sys
from pathlib import Path
import bimvox
here = Path(sys.prefix).resolve()
assert here in Path(bimvox.__file__).resolve().parents, bimvox.__file__
import bimvox_pipeline.demo
assert len(bimvox_pipeline.demo.sample()) > 100_000
bimvox_pipeline.demo.sample = Path("frame.ifc").read_bytes  # the sample itself takes longer
command = importlib.metadata.entry_points(group="console_scripts")["bimvox"].load()
for arguments in (
    ["demo", "-o", "."],
    ["report", "prefab.mcap"],
    ["render", "prefab.mcap", "-o", "prefab.html", "--no-proof"],
):
    sys.argv = ["bimvox", *arguments, "-q"]
    try:
        command()
    except SystemExit as left:
        assert left.code == 0, arguments
    else:
        raise AssertionError("the command did not end the process")
from bimvox.policy.generalist.weights import generalist_record, load_generalist
assert load_generalist().layer_sizes
print("used", generalist_record()["id"])
assert not {"torch", "stable_baselines3"} & set(sys.modules)
for name, module in sys.modules.items():
    if name.split(".")[0].startswith("bimvox"):
        assert here in Path(module.__file__).resolve().parents, module.__file__
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a copy of the project's files, so that nothing is left in the checkout."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for name in ("bimvox", "pipeline", "cli"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run([sys.executable, "-c", BUILD, str(out)], cwd=source, check=True, capture_output=True)
    (file,) = out.glob("bimvox-*.whl")
    return file


@pytest.fixture(scope="module")
def clean(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the Python of a virtual environment with the wheel and the packages it needs, without the checkout."""
    folder = tmp_path_factory.mktemp("clean")
    venv.create(folder, with_pip=False)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    # .pth files in that folder are not run, so an editable installation of the checkout is not found.
    (packages / "needed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder / "bin" / "python"


def test_a_wheel_holds_our_packages_and_no_generic_name(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == OURS
    assert "bimvox/py.typed" in names
    for data in ("*.safetensors", "*.json", "*.css", "*.html", "*.mjs"):
        kept = {file.relative_to(ROOT).as_posix() for file in (ROOT / "bimvox").rglob(data)}
        assert kept
        assert kept <= set(names)


def test_an_index_shows_the_pictures_and_follows_the_links(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (file,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        about = email.message_from_bytes(archive.read(file))
    assert about["Description-Content-Type"] == "text/markdown"
    repository = dict(url.split(", ") for url in about.get_all("Project-URL"))["Repository"]
    assert repository.startswith("https://")
    targets = re.findall(r"\]\(([^)]+)\)", str(about.get_payload()))
    assert any(target.endswith((".png", ".gif", ".webp")) for target in targets)
    for target in targets:
        kind = "raw" if target.endswith((".png", ".gif", ".webp")) else "blob"
        start = f"{repository}/{kind}/v{about['Version']}/"
        assert target.startswith(("https://", "#"))
        if target.startswith(f"{repository}/"):
            assert target.startswith(start)
            assert (ROOT / target.removeprefix(start).partition("#")[0]).exists(), target


@pytest.mark.slow
def test_the_installed_wheel_plans_verifies_reports_and_draws(clean, tmp_path):
    shutil.copy(ROOT / "sample_models" / "frame.ifc", tmp_path)
    known = {"PATH", "HOME", "LANG", "NUMBA_CACHE_DIR"}
    environment = {key: value for key, value in os.environ.items() if key in known}
    done = subprocess.run(
        [str(clean), "-c", MAIN_JOB],
        cwd=tmp_path,
        env={**environment, "BIMVOX_POLICIES": str(tmp_path / "policies")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("used ")
    for name in ("prefab.site.toml", "prefab.mcap", "prefab.png", "prefab.report.html", "prefab.html"):
        assert (tmp_path / name).stat().st_size > 1000
