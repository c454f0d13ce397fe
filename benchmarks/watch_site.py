"""A large site for the benchmark of ``bimvox watch``: 500 components on 200 x 200 x 60 cells of half a metre.

A precast frame of four storeys on a grid of 5 x 5 columns: columns, beams in both directions, floor slabs. Made here,
so that the benchmark needs no file.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sample_models.ifc_author import IfcAuthor

COMPONENTS = 500
_LINES, _BAY_M, _STOREYS, _STOREY_M = 5, 8.0, 4, 4.0
_COLUMN_M, _BEAM_M, _SLAB_M, _GAP_M = 0.5, (0.4, 0.6), 0.2, 0.02
_SLABS_A_BAY = 4

SITE = """\
name = "frame of {components}"

[model]
path = "{model}"
voxel_size_m = 0.5
ground_m = 0.0

[grid]
low_m = [-34.0, -50.0]
high_m = [66.0, 50.0, 29.5]

[areas]
construction = [[-1.0, -1.0], [34.0, -1.0], [34.0, 34.0], [-1.0, 34.0]]
yard = [[[-30.0, -42.0], [50.0, -42.0], [50.0, -7.0], [-30.0, -7.0]]]

[crane]
name = "hammerhead-75"
base_m = [12.0, -5.0, 0.0]
jib_height_m = 34.0
"""

Box = tuple[str, str, tuple[float, float, float], tuple[float, float, float]]


def write_site(folder: Path) -> Path:
    """Write the model and the site file, and return the site file."""
    model = folder / "frame500.ifc"
    model.write_bytes(_model().to_bytes(model.name))
    site = folder / "frame500.site.toml"
    site.write_text(SITE.format(components=COMPONENTS, model=model.name))
    return site


def _model() -> Any:
    ifc = IfcAuthor("frame500")
    building = ifc.spatial("IfcBuilding", "Building", within=ifc.spatial("IfcSite", "Site", (0, 0, 0)))
    storeys = [ifc.storey(f"Storey {n}", n * _STOREY_M, within=building) for n in range(_STOREYS)]
    held: list[list[Any]] = [[] for _ in storeys]
    for ifc_class, name, low, high in list(_boxes())[:COMPONENTS]:
        storey = int(low[2] // _STOREY_M)
        size = tuple(b - a for a, b in zip(low, high, strict=True))
        at = (low[0], low[1], low[2] - storey * _STOREY_M)
        body = ifc.body_of([ifc.box((0.0, 0.0, 0.0), size)])
        held[storey].append(ifc.product(ifc_class, name, at, within=storeys[storey], body=body))
    for storey, products in zip(storeys, held, strict=True):
        if products:
            ifc.contain(storey, products)
    return ifc


def _boxes() -> Iterator[Box]:
    """Every part as class, name, lowest and highest corner, metres; a few more slabs than are wanted."""
    half, (width, height) = _COLUMN_M / 2, _BEAM_M
    for storey in range(_STOREYS):
        foot = storey * _STOREY_M
        under = foot + _STOREY_M - _SLAB_M - height
        for i in range(_LINES):
            for j in range(_LINES):
                x, y = i * _BAY_M, j * _BAY_M
                top = under
                yield "IfcColumn", f"C{storey}{i}{j}", (x - half, y - half, foot), (x + half, y + half, top)
        # Beams along x run over the column heads; those along y fit between them, on the columns' outer parts.
        for i in range(_LINES - 1):
            for j in range(_LINES):
                x0, x1, y = i * _BAY_M, (i + 1) * _BAY_M, j * _BAY_M
                low, high = (x0 + _GAP_M / 2, y - width / 2, under), (x1 - _GAP_M / 2, y + width / 2, under + height)
                yield "IfcBeam", f"X{storey}{i}{j}", low, high
        for i in range(_LINES):
            for j in range(_LINES - 1):
                x, y0, y1 = i * _BAY_M, j * _BAY_M + width / 2 + _GAP_M, (j + 1) * _BAY_M - width / 2 - _GAP_M
                low, high = (x - width / 2, y0, under), (x + width / 2, y1, under + height)
                yield "IfcBeam", f"Y{storey}{i}{j}", low, high
        for i in range(_LINES - 1):
            for j in range(_LINES - 1):
                for n in range(_SLABS_A_BAY):
                    span = _BAY_M / _SLABS_A_BAY
                    x, y0, y1 = i * _BAY_M + n * span, j * _BAY_M + _GAP_M / 2, (j + 1) * _BAY_M - _GAP_M / 2
                    low, high = (
                        (x + _GAP_M / 2, y0, under + height),
                        (x + span - _GAP_M / 2, y1, under + height + _SLAB_M),
                    )
                    yield "IfcSlab", f"S{storey}{i}{j}{n}", low, high
