"""What an extra of ``bimvox[full]`` brings is asked for in one sentence, and nothing else needs it."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from bimvox_cli import main

from bimvox.errors import MissingPackageError
from bimvox.extras import EXTRAS, missing, require
from bimvox.policy import store
from bimvox.policy.config import DqnConfig
from bimvox.policy.generalist.weights import load_generalist
from bimvox.policy.manifest import TrainedPolicy
from bimvox.site.working_hours import public_holidays

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
MODULES = tuple(module for modules in EXTRAS.values() for module in modules)
IMPORT_ALL = f"""
import sys
from importlib import import_module
from pathlib import Path
import bimvox
sys.modules.update(dict.fromkeys({MODULES!r}))
for file in sorted(Path("bimvox_cli").rglob("*.py")) + sorted(Path("bimvox_pipeline").rglob("*.py")):
    if file.stem != "__main__":
        import_module(".".join(file.with_suffix("").parts).removesuffix(".__init__"))
for name in bimvox.__all__:
    getattr(bimvox, name)
"""


@pytest.fixture
def without_extras(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have Python find none of the extras' packages."""
    public_holidays.cache_clear()
    for name in tuple(sys.modules):
        if name.split(".")[0] in MODULES:
            monkeypatch.setitem(sys.modules, name, None)
    for module in MODULES:
        monkeypatch.setitem(sys.modules, module, None)


def test_the_extras_are_those_of_the_package() -> None:
    extras = PROJECT["optional-dependencies"]
    for name, modules in EXTRAS.items():
        listed = {re.split(r"[^\w-]", one)[0] for one in extras[name]}
        assert {module.replace("_", "-") for module in modules} == listed
    assert extras["full"] == [f"bimvox[{','.join(sorted(EXTRAS))}]"]


def test_what_is_installed_is_not_asked_for() -> None:
    for extra in EXTRAS:
        require(extra, "this test")


@pytest.mark.usefixtures("without_extras")
def test_what_is_missing_is_named_with_its_extra() -> None:
    assert [missing(extra) for extra in EXTRAS] == [modules[0] for modules in EXTRAS.values()]
    with pytest.raises(MissingPackageError, match="training needs the package torch") as lacking:
        require("train", "training")
    assert lacking.value.hint == 'pip install --extra-index-url https://download.pytorch.org/whl/cpu "bimvox[train]"'


def test_every_command_and_every_name_of_the_library_is_there_without_the_extras(tmp_path: Path) -> None:
    for folder in ("cli/bimvox_cli", "pipeline/bimvox_pipeline"):
        (tmp_path / Path(folder).name).symlink_to(ROOT / folder)
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def policies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv(store.STORE_VARIABLE, str(tmp_path / "policies"))
    network = load_generalist()
    config = DqnConfig(hidden=network.layer_sizes[1:-1])
    return store.save(TrainedPolicy((), 0, 1.0, 1.0, 10, config, seed=0, network=network), "key")


@pytest.mark.usefixtures("without_extras")
@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        ("train {models}/paper.site.toml", "train"),
        ("plan {models}/paper.site.toml --train -o {out}/plan.mcap", "train"),
        ("watch {out}/changes.json --site {models}/paper.site.toml --retrain 100 -o {out}/plan.mcap", "train"),
        ("experiment paper --quick -o {out}/experiment", "train"),
        ("policy export {policy} -o {out}/policy.sb3.zip", "train"),
        ("optimise {out}/frame.site.toml -o {out}/set-ups", "optimise"),
        ("crane import {out}/chart.csv", "plots"),
        ("plan {out}/holidays.site.toml -o {out}/plan.mcap", "holidays"),
    ],
)
def test_a_command_that_needs_an_extra_says_so_in_one_sentence(
    arguments: str, extra: str, policies: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = (ROOT / "sample_models" / "frame.ifc").as_posix()
    site = f'[model]\npath = "{model}"\n[areas]\nyard = [[[-12.0, -2.0], [-6.0, -2.0], [-6.0, 10.0], [-12.0, 10.0]]]\n'
    site += '[crane]\nmachine = "hammerhead-45"\nbase_m = [-4.0, 4.0]\n'
    (tmp_path / "frame.site.toml").write_text(site)
    (tmp_path / "holidays.site.toml").write_text(f'{site}[calendar]\ncountry = "DE"\n')
    before = {file.name for file in tmp_path.iterdir()}
    line = arguments.format(models=ROOT / "sample_models", out=tmp_path, policy=policies)
    assert main.run([*line.split(), "-q"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    error, hint = err.splitlines()
    assert re.fullmatch(rf"error: .* needs the package ({'|'.join(EXTRAS[extra])}), which is not installed", error)
    assert hint.startswith("  hint: pip install ")
    assert hint.endswith(f'"bimvox[{extra}]"')
    assert {file.name for file in tmp_path.iterdir()} == before
