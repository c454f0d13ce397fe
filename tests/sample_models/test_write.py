"""The committed files are those that the code writes, and the README describes them correctly."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import ifcopenshell
import pytest
import trimesh
from bimvox_pipeline import demo

from sample_models.write import FILES, write_all

IFC_FILES = [name for name in FILES if name.endswith(".ifc")]
NEVER_LIFTED = {"IfcFooting", "IfcWindow", "IfcDoor", "IfcOpeningElement"}


def counts_said(readme: Path) -> dict[tuple[str, str], int]:
    rows = re.findall(r"^\| `([^`]+)` \|.*\| (.+) \|$", readme.read_text("utf-8"), flags=re.MULTILINE)
    counts = {file: re.findall(r"(\d+) (lifts|bodies|Ifc\w+)", text) for file, text in rows}
    return {(file, kind): int(count) for file, found in counts.items() for count, kind in found}


def counts_found(path: Path, kinds: set[str]) -> dict[str, int]:
    if path.suffix != ".ifc":
        scene: Any = trimesh.load_scene(path)
        names = list(scene.geometry) if path.suffix == ".stl" else list(scene.graph.nodes_geometry)
        return {"bodies": len(names), "lifts": sum(name.startswith("container-") for name in names)}
    file = ifcopenshell.open(path)
    # A part of an assembly is not lifted alone.
    parts = {part.id() for whole in file.by_type("IfcElementAssembly") for r in whole.IsDecomposedBy for part in r[5]}
    elements = [e for e in file.by_type("IfcElement") if e.is_a() not in NEVER_LIFTED and e.id() not in parts]
    return {kind: len(elements) if kind == "lifts" else len(file.by_type(kind)) for kind in kinds}


def test_committed_files_are_what_the_code_writes(samples: Path, tmp_path: Path) -> None:
    for path in write_all(tmp_path / "new"):
        assert path.read_bytes() == (samples / path.name).read_bytes(), f"{path.name}: python -m sample_models.write"


def test_the_sample_in_the_package_is_that_of_the_checkout(samples: Path) -> None:
    assert demo.sample() == (samples / demo.SAMPLE).read_bytes(), "python -m sample_models.write"


def test_another_process_writes_the_same_bytes_where_it_is_told(samples: Path, tmp_path: Path) -> None:
    # Another hash seed and another time must not change the files.
    command = [sys.executable, "-m", "sample_models.write", "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=samples.parent, capture_output=True, text=True, check=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {name: FILES[name]() for name in FILES}
    assert all(name in done.stdout for name in FILES)


def test_readme_counts_are_those_of_the_files(samples: Path) -> None:
    said = counts_said(samples / "README.md")
    assert {file for file, _ in said} == set(FILES)
    for name in FILES:
        of_file = {kind: count for (file, kind), count in said.items() if file == name}
        assert counts_found(samples / name, set(of_file)) == of_file, name


@pytest.mark.parametrize("name", IFC_FILES)
def test_readme_names_every_class_of_element(samples: Path, name: str) -> None:
    said = {kind for file, kind in counts_said(samples / "README.md") if file == name}
    assert {element.is_a() for element in ifcopenshell.open(samples / name).by_type("IfcElement")} <= said


@pytest.mark.parametrize("name", IFC_FILES)
def test_global_ids_are_unique(samples: Path, name: str) -> None:
    ids = Counter(entity.GlobalId for entity in ifcopenshell.open(samples / name).by_type("IfcRoot"))
    assert [global_id for global_id, count in ids.items() if count > 1] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", IFC_FILES)
def test_files_are_valid_against_their_schema(samples: Path, name: str) -> None:
    import ifcopenshell.validate as validation

    logger = validation.json_logger()
    validation.validate(ifcopenshell.open(samples / name), logger, express_rules=name != "prefab.ifc")
    assert logger.statements == []


@pytest.mark.parametrize("name", IFC_FILES)
def test_headers_name_neither_tool_nor_time(samples: Path, name: str) -> None:
    header = (samples / name).read_text("ascii").split("ENDSEC;")[0]
    assert "IfcOpenShell" not in header
    assert f"FILE_NAME('{name}','2024-01-01T00:00:00'" in header


def test_all_of_it_is_small(samples: Path) -> None:
    assert sum((samples / name).stat().st_size for name in FILES) < 1_000_000
