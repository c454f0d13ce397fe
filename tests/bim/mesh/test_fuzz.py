"""Any mesh file gives a building or a typed error, nothing else."""

from __future__ import annotations

import io
import json
import random
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mesh_samples import gltf_files, samples, with_inline_buffers, zipped

from bimvox.bim.read import read_building
from bimvox.errors import BimvoxError

SAMPLES = samples()
ODD: list[Any] = [None, -1, 0, 2**31, 10**30, 1e308, "", "x", [], {}, True, [1], 1.5, "../x", "data:,", [[1]], "VEC3"]


def outcome(path: Path, data: bytes) -> bool:
    """Return whether a file can be read; any error that is not typed fails the test."""
    path.write_bytes(data)
    try:
        building = read_building(path)
    except BimvoxError:
        return False
    assert all(np.isfinite(element.mesh.triangles_m).all() for element in building.elements)
    assert all(np.isfinite(element.mass_kg) and element.mass_kg >= 0 for element in building.elements)
    return True


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Return bytes of which some are flipped, replaced, cut out or repeated."""
    changed = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8])):
        at, kind = rng.randrange(len(changed)), rng.randrange(4)
        if kind == 0:
            changed[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            changed[at] = rng.choice(b'0123456789-e.,[]{}"<>/ \n')
        elif kind == 2:
            del changed[at : at + rng.randrange(1, min(40, len(changed) - 10))]
        else:
            changed[at:at] = changed[at : at + rng.randrange(1, 80)]
    return bytes(changed)


@pytest.mark.parametrize("name", SAMPLES)
def test_cut_off_anywhere(name: str, tmp_path: Path) -> None:
    data = SAMPLES[name]
    path = tmp_path / f"a{Path(name).suffix}"
    assert outcome(path, data)
    for part in range(1, 50):
        outcome(path, data[: max(1, len(data) * part // 50)])


@pytest.mark.parametrize("name", SAMPLES)
def test_changed_anywhere(name: str, tmp_path: Path) -> None:
    rng = random.Random(name)
    read = [outcome(tmp_path / f"a{Path(name).suffix}", damaged(SAMPLES[name], rng)) for _ in range(120)]
    assert not all(read)


def changed_tree(tree: Any, rng: random.Random) -> Any:
    """Replace or remove one value somewhere in a JSON document."""
    tree = json.loads(json.dumps(tree))
    node = tree
    while True:
        key = rng.choice(list(node) if isinstance(node, dict) else list(range(len(node))))
        if not isinstance(node[key], dict | list) or not node[key] or rng.random() < 0.15:
            break
        node = node[key]
    if rng.random() < 0.2:
        del node[key]
    else:
        node[key] = rng.choice(ODD)
    return tree


def test_gltf_with_any_value_replaced(tmp_path: Path) -> None:
    rng, tree = random.Random(7), with_inline_buffers(gltf_files())
    read = [outcome(tmp_path / "a.gltf", json.dumps(changed_tree(tree, rng)).encode()) for _ in range(300)]
    assert any(read)
    assert not all(read)


def test_3mf_with_its_xml_changed(tmp_path: Path) -> None:
    rng = random.Random(7)
    with zipfile.ZipFile(io.BytesIO(SAMPLES["a.3mf"])) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    model = next(name for name in parts if name.endswith(".model"))
    read = [outcome(tmp_path / "a.3mf", zipped(parts | {model: damaged(parts[model], rng)})) for _ in range(150)]
    assert any(read)
    assert not all(read)
