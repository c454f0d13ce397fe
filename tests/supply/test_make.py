"""The targets of the Makefile that install, audit and build do the same with the environment activated as without."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BOOTSTRAP = ROOT / ".venv" / "uv-bootstrap" / "bin" / "python"
CONFIGS = {
    "a folder of wheels": "[global]\nfind-links = /srv/wheels\n",
    "only two folders of wheels": "[global]\nno-index = true\nfind-links =\n  /srv/wheels\n  /srv/more\n",
    "a local index": "[global]\nindex-url = file:///srv/simple\n",
    "nothing": "",
}
pytestmark = pytest.mark.skipif(not BOOTSTRAP.exists(), reason="the environment is not that of make setup")


def printed(target: str, path: str, config: Path) -> str:
    """Return the commands of a target, which are not run."""
    set_by_others = ("PIP_", "MAKE", "MFLAGS", "TORCH_", "VENV", "PYTHON")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(set_by_others)}
    done = subprocess.run(
        ["make", "-n", "-W", "pyproject.toml", target],
        cwd=ROOT,
        env={**kept, "PATH": path, "PIP_CONFIG_FILE": str(config)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("target", ["audit", "test-slim"])
def test_an_activated_environment_changes_nothing(target: str, config: str, tmp_path: Path) -> None:
    file = tmp_path / "pip.conf"
    file.write_text(CONFIGS[config])
    own = str(ROOT / ".venv" / "bin")
    others = [folder for folder in os.environ["PATH"].split(os.pathsep) if folder != own]
    outside = os.pathsep.join([str(Path(sys._base_executable).parent), *others])
    commands = printed(target, outside, file)
    assert printed(target, os.pathsep.join([own, outside]), file) == commands
    assert ("--find-links /srv/wheels " in commands) == ("find-links" in CONFIGS[config])
    assert ("--find-links /srv/more --require-hashes" in commands) == ("/srv/more" in CONFIGS[config])
    assert ("constraints-cpu.txt" in commands) == ("find-links" in CONFIGS[config])
