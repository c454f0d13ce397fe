"""The lock files of the checkout, and their reader."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from supply.lock import normalised, read_lock

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
HASH = "sha256:" + "0123456789abcdef" * 4


def requirements() -> list[Requirement]:
    groups = [*PROJECT["project"]["optional-dependencies"].values(), *PROJECT["dependency-groups"].values()]
    texts = [one for group in (PROJECT["project"]["dependencies"], *groups) for one in group if isinstance(one, str)]
    named = [Requirement(text) for text in texts]
    return [one for one in named if one.name != PROJECT["project"]["name"]]  # an extra that is made of others


def test_every_requirement_is_locked_with_hashes_at_a_version_that_it_allows():
    pins = read_lock(ROOT / "constraints.txt")
    for requirement in requirements():
        versions = [pin.version for pin in pins.get(normalised(requirement.name), ())]
        assert versions, f"{requirement} is not locked: run make constraints"
        assert all(requirement.specifier.contains(version) for version in versions), requirement


def test_the_installer_is_locked_too():
    ((uv,),) = read_lock(ROOT / "bootstrap.txt").values()
    assert uv.name == "uv"
    assert len(uv.hashes) > 10, "one for each platform"


def test_torchs_cpu_build_is_of_the_locked_version():
    ((cpu,),) = read_lock(ROOT / "constraints-cpu.txt").values()
    (torch,) = read_lock(ROOT / "constraints.txt")["torch"]
    assert cpu.name == "torch"
    assert cpu.version == f"{torch.version}+cpu"


@pytest.mark.parametrize(
    "entry",
    ["numpy==2.0", "numpy>=2 --hash=" + HASH, "numpy==2.0 --hash=sha256:12", "-e .", "numpy==2.0 --hash=md5:12"],
)
def test_an_entry_without_an_exact_version_or_a_hash_is_an_error(tmp_path, entry):
    file = tmp_path / "lock.txt"
    file.write_text(f"# a comment\nzipp==1.0 \\\n    --hash={HASH}\n{entry}\n")
    with pytest.raises(ValueError, match=r"lock\.txt: not an exact version with hashes: "):
        read_lock(file)


def test_a_package_may_have_a_version_for_each_python(tmp_path):
    file = tmp_path / "lock.txt"
    file.write_text(
        f"Zope.Thing==1.0 ; python_full_version < '3.12' \\\n    --hash={HASH} \\\n    --hash={HASH}\n"
        f"zope_thing==2.0 ; python_full_version >= '3.12' \\\n    --hash={HASH}\n"
    )
    ((first, second),) = read_lock(file).values()
    assert (first.name, first.version, first.hashes) == ("zope-thing", "1.0", (HASH, HASH))
    assert second.version == "2.0"
