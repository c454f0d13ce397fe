"""The wheel without the extras of ``bimvox[full]``, in the environment that ``make test-slim`` makes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from bimvox.extras import EXTRAS
from supply.machine_code import can_compile

SLIM = os.environ.get("BIMVOX_SLIM")
MOST_MB = 700
"""Without the 9 MB of machine code that the wheel for Linux on x86-64 brings."""
pytestmark = pytest.mark.skipif(SLIM is None, reason="make test-slim makes the environment")
SIZE = """
from importlib.metadata import distributions
files = [file for one in distributions() for file in one.files or () if "machine_code" not in file.parts]
print(sum(file.size or 0 for file in files) // 10**6)
"""


def bimvox(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command of the environment in a folder, without anything of the checkout."""
    known = {"PATH", "HOME", "LANG"}
    environment = {key: value for key, value in os.environ.items() if key in known}
    return subprocess.run(
        [str(Path(SLIM or "") / "bin" / "bimvox"), *arguments],
        cwd=folder,
        env={**environment, "BIMVOX_POLICIES": str(folder / "policies"), "NUMBA_CACHE_DIR": str(folder / "kernels")},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def python() -> str:
    return str(Path(SLIM or "") / "bin" / "python")


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which the demo has been run."""
    folder = tmp_path_factory.mktemp("slim")
    done = bimvox(folder, "demo", "-o", ".", "-q")
    assert done.returncode == 0, done.stderr
    return folder


def test_it_takes_less_than_700_mb_and_has_no_package_of_an_extra(python: str) -> None:
    size_mb = int(subprocess.run([python, "-I", "-c", SIZE], capture_output=True, text=True, check=True).stdout)
    assert 300 < size_mb < MOST_MB
    modules = [module for modules in EXTRAS.values() for module in modules]
    found = f"from importlib.util import find_spec; print(*[m for m in {modules} if find_spec(m)])"
    assert subprocess.run([python, "-I", "-c", found], capture_output=True, text=True, check=True).stdout.split() == []


@pytest.mark.skipif(not can_compile(), reason="no wheel with machine code is made here")
def test_a_first_run_compiles_nothing(planned: Path) -> None:
    assert [file.name for file in (planned / "kernels").rglob("*.nbc")] == []


@pytest.mark.parametrize(
    "arguments",
    [
        "plan prefab.site.toml -o again.mcap",
        "verify prefab.mcap --site prefab.site.toml",
        "render prefab.mcap -o prefab.html",
        "render prefab.mcap --lift 3 -o lift.png",
        "export prefab.mcap --to csv -o prefab.csv",
        "export prefab.mcap --to glb -o prefab.glb",
        "export prefab.mcap --to msproject -o prefab.xml",
        "report prefab.mcap -o prefab.report.html",
        "inspect prefab.mcap",
        "cranes prefab.site.toml",
    ],
)
def test_it_plans_proves_draws_and_exports(planned: Path, arguments: str) -> None:
    done = bimvox(planned, *arguments.split(), "-q")
    assert done.returncode == 0, done.stderr
    words = arguments.split()
    if "-o" in words:
        assert (planned / words[words.index("-o") + 1]).stat().st_size > 1000


def test_it_plans_a_change_again(planned: Path) -> None:
    truck = {"id": "truck", "box": {"min": [2.0, 2.0, 0.0], "max": [4.5, 9.0, 3.2]}}
    (planned / "changes.json").write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [truck]}))
    shutil.copy(planned / "prefab.mcap", planned / "watched.mcap")
    files = ["--site", "prefab.site.toml", "-o", "watched.mcap"]
    done = bimvox(planned, "watch", "changes.json", *files, "--once", "--json")
    assert done.returncode in (0, 1), done.stderr  # 1: the truck may stand where a lift must pass
    changes = [json.loads(line) for line in done.stdout.splitlines()]
    assert any(one["replanned"] or one["kept"] for one in changes)


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        ("train prefab.site.toml", "train"),
        ("experiment paper --quick", "train"),
        ("optimise prefab.site.toml", "optimise"),
        ("report prefab.mcap --figures figures", "plots"),
    ],
)
def test_what_needs_an_extra_says_so(planned: Path, arguments: str, extra: str) -> None:
    done = bimvox(planned, *arguments.split(), "-q")
    assert done.returncode == 2
    error, hint = done.stderr.splitlines()
    assert error.startswith("error: ")
    assert error.endswith("which is not installed")
    assert hint.endswith(f'"bimvox[{extra}]"')
