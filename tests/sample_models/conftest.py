from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import numpy as np
import pytest
from numpy.typing import NDArray

SAMPLES = Path(__file__).parents[2] / "sample_models"
STEP_M = 0.01
# No face of a sample is on a sampling point, because faces are on a grid of 5 mm.
SHIFT_M = 0.00337


@dataclass
class Lift:
    """What is lifted as one: a product, or an assembly with its parts."""

    name: str
    ifc_class: str
    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int64]

    @property
    def bounds_m(self) -> NDArray[np.float64]:
        return np.stack([self.vertices_m.min(axis=0), self.vertices_m.max(axis=0)])

    @property
    def is_structure(self) -> bool:
        return self.ifc_class == "IfcFooting"

    @property
    def is_fitting(self) -> bool:
        return self.ifc_class in ("IfcWindow", "IfcDoor")

    @cached_property
    def volume_and_centre(self) -> tuple[float, NDArray[np.float64]]:
        a, b, c = np.moveaxis(self.vertices_m[self.faces], 1, 0)
        volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        return float(volumes.sum()), ((a + b + c) / 4 * volumes[:, None]).sum(axis=0) / volumes.sum()

    @cached_property
    def heights(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the plan cell of the low corner, and the lowest and highest surface per plan cell (infinite: none)."""
        low, high = np.floor((self.bounds_m[:, :2] - SHIFT_M) / STEP_M).astype(np.int64)
        high += 2
        bottom = np.full(high - low, np.inf)
        top = np.full(high - low, -np.inf)
        for corners in self.vertices_m[self.faces]:
            (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = corners
            twice_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
            if abs(twice_area) < 1e-9:
                continue
            first = np.floor((corners[:, :2].min(axis=0) - SHIFT_M) / STEP_M).astype(np.int64) - low
            last = np.ceil((corners[:, :2].max(axis=0) - SHIFT_M) / STEP_M).astype(np.int64) - low + 1
            first = np.maximum(first, 0)
            window = (slice(first[0], last[0]), slice(first[1], last[1]))
            cells = bottom[window].shape
            x = (np.arange(cells[0]) + first[0] + low[0])[:, None] * STEP_M + SHIFT_M
            y = (np.arange(cells[1]) + first[1] + low[1])[None, :] * STEP_M + SHIFT_M
            v = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / twice_area
            w = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / twice_area
            inside = (v >= -1e-9) & (w >= -1e-9) & (v + w <= 1 + 1e-9)
            z = z0 + v * (z1 - z0) + w * (z2 - z0)
            bottom[window] = np.where(inside, np.minimum(bottom[window], z), bottom[window])
            top[window] = np.where(inside, np.maximum(top[window], z), top[window])
        return low, bottom, top


def _shapes_of(path: Path) -> dict[str, Lift]:
    """Return every product with a body, by GlobalId, in metres and world coordinates, without openings."""
    file = ifcopenshell.open(path)
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    products = [p for p in [*file.by_type("IfcElement"), *file.by_type("IfcSite")] if p.Representation]
    products = [p for p in products if not p.is_a("IfcOpeningElement")]
    found = {}
    for product in products:
        geometry = ifcopenshell.geom.create_shape(settings, product).geometry
        vertices = np.asarray(geometry.verts, dtype=np.float64).reshape(-1, 3)
        faces = np.asarray(geometry.faces, dtype=np.int64).reshape(-1, 3)
        found[product.GlobalId] = Lift(product.Name, product.is_a(), vertices, faces)
    return found


def _lifts_of(path: Path) -> list[Lift]:
    """Return the same with the parts of each assembly joined."""
    file = ifcopenshell.open(path)
    singles: list[Lift] = []
    wholes: dict[str, list[Lift]] = {}
    for global_id, lift in _shapes_of(path).items():
        whole: Any = ifcopenshell.util.element.get_aggregate(file.by_guid(global_id))
        if whole is not None and whole.is_a("IfcElement"):
            wholes.setdefault(whole.Name, []).append(lift)
        elif lift.ifc_class != "IfcSite":
            singles.append(lift)
    for name, parts in wholes.items():
        offsets = np.cumsum([0, *(len(p.vertices_m) for p in parts)])
        faces = np.concatenate([p.faces + o for p, o in zip(parts, offsets, strict=False)])
        vertices = np.concatenate([p.vertices_m for p in parts])
        singles.append(Lift(name, "IfcElementAssembly", vertices, faces))
    return singles


@pytest.fixture(scope="session")
def samples() -> Path:
    return SAMPLES


@pytest.fixture(scope="session")
def shapes_of() -> Callable[[Path], dict[str, Lift]]:
    return _shapes_of


@pytest.fixture(scope="session")
def prefab_parts() -> dict[str, Lift]:
    return _shapes_of(SAMPLES / "prefab.ifc")


@pytest.fixture(scope="session")
def prefab_lifts() -> list[Lift]:
    return _lifts_of(SAMPLES / "prefab.ifc")
