"""The SBOM of a wheel."""

from __future__ import annotations

import hashlib
import json
import zipfile
from importlib.metadata import metadata
from pathlib import Path

import pytest

from supply.lock import Pin, read_lock
from supply.sbom import main, sbom

LOCKS = [Path(__file__).parents[2] / name for name in ("constraints.txt", "constraints-cpu.txt")]
METADATA = """Metadata-Version: 2.4
Name: bimvox
Version: 0.1.0
License-Expression: Apache-2.0
Requires-Dist: xarray>=2024
Requires-Dist: colorama; sys_platform == "none"
Requires-Dist: ray>=2; extra == "ray"
"""


def wheel_with(folder: Path, metadata: str) -> Path:
    file = folder / "bimvox-0.1.0-py3-none-any.whl"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(zipfile.ZipInfo("bimvox-0.1.0.dist-info/METADATA"), metadata)
    return file


def test_it_names_what_the_wheel_needs_at_run_time_and_what_that_needs(tmp_path):
    file = wheel_with(tmp_path, METADATA)
    pins = read_lock(*LOCKS)
    document = sbom(file, pins)
    assert (document["bomFormat"], document["specVersion"]) == ("CycloneDX", "1.6")
    about = document["metadata"]["component"]
    assert about["hashes"] == [{"alg": "SHA-256", "content": hashlib.sha256(file.read_bytes()).hexdigest()}]
    assert about["licenses"] == [{"expression": "Apache-2.0"}]
    components = {one["name"]: one for one in document["components"]}
    assert {"xarray", "numpy", "pandas", "packaging", "python-dateutil"} <= components.keys()
    assert components.keys().isdisjoint({"ray", "colorama", "pytest"})
    for name, component in components.items():
        (pin,) = (one for one in pins[name] if one.version == component["version"])
        assert {one["value"] for one in component["properties"]} == set(pin.hashes)
    references = {about["bom-ref"], *(one["bom-ref"] for one in document["components"])}
    needs = {one["ref"]: set(one["dependsOn"]) for one in document["dependencies"]}
    assert needs.keys() == references
    assert set().union(*needs.values()) == references - {about["bom-ref"]}
    assert components["numpy"]["bom-ref"] in needs[components["pandas"]["bom-ref"]]


def test_it_names_what_the_full_installation_has_through_extras_of_the_wheel_itself(tmp_path):
    extras = """Requires-Dist: bimvox[plots,train]; extra == "full"
Requires-Dist: matplotlib>=3; extra == "plots"
Requires-Dist: stable-baselines3; extra == "train"
"""
    document = sbom(wheel_with(tmp_path, METADATA + extras), read_lock(*LOCKS))
    names = {one["name"] for one in document["components"]}
    assert {"matplotlib", "fonttools", "stable-baselines3", "torch", "sympy", "xarray"} <= names
    assert names.isdisjoint({"bimvox", "ray"})


def test_a_build_whose_hash_is_not_locked_is_named_without_hashes(tmp_path):
    pins = dict(read_lock(*LOCKS))
    installed = metadata("torch")["Version"]
    pins["torch"] = (Pin("torch", installed.partition("+")[0], ("sha256:aa",)),)
    document = sbom(wheel_with(tmp_path, METADATA + "Requires-Dist: torch\n"), pins)
    (torch,) = (one for one in document["components"] if one["name"] == "torch")
    assert torch["version"] == installed
    assert [one["value"] for one in torch["properties"]] == ([] if "+" in installed else ["sha256:aa"])


def test_the_same_wheel_gives_the_same_bytes(tmp_path):
    file = wheel_with(tmp_path, METADATA)
    written = []
    for _ in range(2):
        assert main([str(file), *map(str, LOCKS)]) == 0
        written.append(file.with_name(f"{file.name}.cdx.json").read_bytes())
    assert written[0] == written[1]
    other = wheel_with(tmp_path, METADATA + "Requires-Dist: ruff\n")
    serial = json.loads(written[0])["serialNumber"]
    assert sbom(other, read_lock(*LOCKS))["serialNumber"] != serial


@pytest.mark.parametrize(
    ("needed", "why"), [("pytest", "not in the lock file"), ("no-such-package", "no-such-package")]
)
def test_what_is_not_locked_or_not_installed_is_an_error_and_nothing_is_written(tmp_path, capsys, needed, why):
    file = wheel_with(tmp_path, METADATA + f"Requires-Dist: {needed}\n")
    lock = tmp_path / "lock.txt"
    lock.write_text(LOCKS[0].read_text("utf-8").replace("\npytest==", "\npytest-of-another-name=="))
    assert main([str(file), str(lock), str(LOCKS[1])]) == 2
    assert why in capsys.readouterr().err
    assert not file.with_name(f"{file.name}.cdx.json").exists()
