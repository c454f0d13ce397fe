"""One case: a building at one cell size, as the arrays that every tool is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.voxelize.office import office
from benchmarks.voxelize.solids import blob, cube, terrain
from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.bim.read import read_building
from bimvox.voxelization.lattice import cell_range
from bimvox.voxelization.meshes import Meshes

SAMPLE = Path(__file__).parents[2] / "sample_models" / "prefab.ifc"


@dataclass(frozen=True, slots=True)
class CaseSpec:
    """The case to measure.

    Attributes:
        name: Unique name of the case.
        make: Reads or generates the building.
        voxel_size_m: Edge of a cell.
        dense: Whether it is one body that is nearly all interior.
        peers: Whether the other tools run it too.
        windows: Largest number of boxes of cells in which answers are judged.
    """

    name: str
    make: Callable[[], Building]
    voxel_size_m: float
    dense: bool = False
    peers: bool = True
    windows: int = 60


def full_cases() -> list[CaseSpec]:
    """Return the cases of the published table."""
    return [
        CaseSpec("prefab, 0.25 m", lambda: read_building(SAMPLE), 0.25),
        CaseSpec("prefab, 0.1 m", lambda: read_building(SAMPLE), 0.1),
        CaseSpec("office, 0.1 m", office, 0.1),
        CaseSpec("office, 0.05 m", office, 0.05, peers=False),
        CaseSpec("blob, 0.05 m", lambda: blob(12.0), 0.05, dense=True),
        CaseSpec("terrain, 0.1 m", lambda: terrain(60.0, 14.0), 0.1, dense=True),
        CaseSpec("cube, 0.05 m", lambda: cube(20.3), 0.05, dense=True, peers=False),
    ]


def quick_cases() -> list[CaseSpec]:
    """Return small cases for a trial of one minute."""
    return [
        CaseSpec("office of 1 storey, 0.25 m", lambda: office(1), 0.25, windows=12),
        CaseSpec("small blob, 0.2 m", lambda: blob(4.0, sides=16), 0.2, dense=True, windows=12),
    ]


def model_case(path: Path, voxel_size_m: float) -> CaseSpec:
    """Return the case of a model file; it is named without its folder."""
    return CaseSpec(f"{path.name}, {voxel_size_m:g} m", lambda: read_building(path), voxel_size_m)


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """A box of lattice cells in which answers are judged, and the parts whose bounds reach into it.

    Attributes:
        low: (3,) int64 lattice cell.
        high: (3,) int64, one past the highest.
        parts: (P,) int64 indices of parts.
    """

    low: NDArray[np.int64]
    high: NDArray[np.int64]
    parts: NDArray[np.int64]

    @property
    def shape(self) -> tuple[int, int, int]:
        """Cells along x, y and z."""
        x, y, z = (int(n) for n in self.high - self.low)
        return (x, y, z)


@dataclass(frozen=True, eq=False)
class Scene:
    """The triangles of a case, part by part.

    Attributes:
        vertices_m: (V, 3) float64.
        faces: (F, 3) int32, into ``vertices_m``.
        starts: (P + 1,) int64, the first face of each part, and the number of faces.
        low: (3,) int64, lowest lattice cell of the grid.
        high: (3,) int64, one past its highest.
        voxel_size_m: Edge of a cell.
    """

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]
    starts: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    voxel_size_m: float

    @classmethod
    def of(cls, building: Building, voxel_size_m: float) -> Scene:
        """Return the triangles of a building's elements."""
        meshes = [element.mesh for element in building.elements]
        first = np.cumsum([0, *(len(mesh.vertices_m) for mesh in meshes)])
        faces = [mesh.faces + n for mesh, n in zip(meshes, first, strict=False)]
        bounds = Meshes.of(meshes).bounds(voxel_size_m, np.zeros(3))
        low, high = cell_range(bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0), voxel_size_m)
        return cls(
            vertices_m=np.concatenate([mesh.vertices_m for mesh in meshes]),
            faces=np.concatenate(faces).astype(np.int32),
            starts=np.cumsum([0, *(len(mesh.faces) for mesh in meshes)]),
            low=low,
            high=high,
            voxel_size_m=voxel_size_m,
        )

    @cached_property
    def parts(self) -> list[TriangleMesh]:
        """Return the scene in which no two parts share a vertex."""
        meshes = []
        for start, stop in zip(self.starts[:-1], self.starts[1:], strict=True):
            used, faces = np.unique(self.faces[start:stop], return_inverse=True)
            meshes.append(TriangleMesh(self.vertices_m[used], faces.reshape(-1, 3).astype(np.int32)))
        return meshes

    @property
    def shape(self) -> tuple[int, int, int]:
        """Cells along x, y and z."""
        x, y, z = (int(n) for n in self.high - self.low)
        return (x, y, z)

    def building(self) -> Building:
        """Return the parts as a building again."""
        elements = tuple(
            Element(str(n), str(n), "Mesh", "", mesh, Role.COMPONENT, 0.0, "default")
            for n, mesh in enumerate(self.parts)
        )
        return Building(elements, (), Source("scene", "0" * 64, "generated", "m"))

    def save(self, path: Path, windows: list[Window]) -> None:
        """Write the triangles, and where answers are wanted."""
        boxes = np.array([(window.low, window.high) for window in windows], np.int64).reshape(-1, 2, 3)
        np.savez(
            path,
            vertices_m=self.vertices_m,
            faces=self.faces,
            starts=self.starts,
            grid=np.stack([self.low, self.high]),
            voxel_size_m=self.voxel_size_m,
            boxes=boxes,
            counts=np.array([len(window.parts) for window in windows], np.int64),
            parts=np.concatenate([np.empty(0, np.int64), *(window.parts for window in windows)]),
        )

    @classmethod
    def load(cls, path: Path) -> tuple[Scene, list[Window]]:
        """Read what ``save`` wrote."""
        with np.load(path) as data:
            scene = cls(
                vertices_m=data["vertices_m"],
                faces=data["faces"],
                starts=data["starts"],
                low=data["grid"][0],
                high=data["grid"][1],
                voxel_size_m=float(data["voxel_size_m"]),
            )
            stops = np.cumsum(data["counts"])
            of_window = np.split(data["parts"], stops[:-1]) if len(stops) else []
            windows = [Window(box[0], box[1], parts) for box, parts in zip(data["boxes"], of_window, strict=True)]
        return scene, windows
