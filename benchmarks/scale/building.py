"""Large sites of any number of components, on 200 x 200 cells of half a metre.

A precast frame on a square grid of columns 8 m apart: columns, beams in both directions, floor slabs. It has four
storeys and the smallest grid for the requested number of parts; above what one crane reaches, it has more storeys, and
the crane and its cells rise with it. Surplus parts, the last slabs, are omitted. The site keeps its length and width.
It is generated, so the benchmarks need no file.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import ceil
from pathlib import Path
from typing import Any

from sample_models.ifc_author import IfcAuthor

_BAY_M, _STOREYS, _MOST_STOREYS, _STOREY_M = 8.0, 4, 12, 4.0
_COLUMN_M, _BEAM_M, _SLAB_M, _GAP_M = 0.5, (0.4, 0.6), 0.2, 0.02
_SITE_M = 100.0
_SLABS_A_BAY = {2: 4, 3: 4, 4: 4, 5: 4, 6: 7, 7: 8}
"""By columns in a row; the far slabs of the largest buildings are narrower, within the crane's capacity."""
_ABOVE_M, _JIB_ABOVE_M = 13.5, 18.0
"""Cells and jib above the roof."""

SITE = """\
name = "frame of {components}"

[model]
path = "{model}"
voxel_size_m = 0.5
ground_m = 0.0

[grid]
low_m = [{low}, -50.0]
high_m = [{high}, 50.0, {top}]

[areas]
construction = [[-1.0, -1.0], [{far}, -1.0], [{far}, {far}], [-1.0, {far}]]
yard = [[[{yard_low}, -42.0], [{yard_high}, -42.0], [{yard_high}, -7.0], [{yard_low}, -7.0]]]

[crane]
name = "hammerhead-75"
base_m = [{base}, -5.0, 0.0]
jib_height_m = {jib}
"""

Box = tuple[str, str, tuple[float, float, float], tuple[float, float, float]]


def write_site(folder: Path, components: int) -> Path:
    """Write a model with a number of components and its site file, and return the site file.

    Raises:
        ValueError: If the site is too small for that many components.
    """
    lines, storeys = size_for(components)
    model = folder / f"frame{components}.ifc"
    model.write_bytes(_model(components, lines, storeys).to_bytes(model.name))
    middle = _BAY_M * (lines - 1) / 2
    site = folder / f"frame{components}.site.toml"
    site.write_text(
        SITE.format(
            components=components,
            model=model.name,
            low=middle - _SITE_M / 2,
            high=middle + _SITE_M / 2,
            top=storeys * _STOREY_M + _ABOVE_M,
            jib=storeys * _STOREY_M + _JIB_ABOVE_M,
            far=2 * middle + 2.0,
            yard_low=middle - 46.0,
            yard_high=middle + 34.0,
            base=middle - 4.0,
        )
    )
    return site


def size_for(components: int) -> tuple[int, int]:
    """Return columns in a row and storeys of the smallest building with at least that many parts."""
    for lines, slabs in _SLABS_A_BAY.items():
        bays = lines - 1
        storeys = ceil(components / (lines**2 + 2 * lines * bays + slabs * bays**2))
        if 0 < storeys <= (_MOST_STOREYS if lines == max(_SLABS_A_BAY) else _STOREYS):
            return lines, max(storeys, _STOREYS)
    raise ValueError(f"no building of {components} components fits the site")


def _model(components: int, lines: int, storeys: int) -> Any:
    ifc = IfcAuthor(f"frame{components}")
    building = ifc.spatial("IfcBuilding", "Building", within=ifc.spatial("IfcSite", "Site", (0, 0, 0)))
    levels = [ifc.storey(f"Storey {n}", n * _STOREY_M, within=building) for n in range(storeys)]
    held: list[list[Any]] = [[] for _ in levels]
    for ifc_class, name, low, high in islice(boxes(lines, storeys), components):
        storey = int(low[2] // _STOREY_M)
        size = (high[0] - low[0], high[1] - low[1], high[2] - low[2])
        at = (low[0], low[1], low[2] - storey * _STOREY_M)
        body = ifc.body_of([ifc.box((0.0, 0.0, 0.0), size)])
        held[storey].append(ifc.product(ifc_class, name, at, within=levels[storey], body=body))
    for level, products in zip(levels, held, strict=True):
        if products:
            ifc.contain(level, products)
    return ifc


def boxes(lines: int, storeys: int = _STOREYS) -> Iterator[Box]:
    """Return every part of a building as class, name, lowest and highest corner, metres."""
    half, (width, height), slabs = _COLUMN_M / 2, _BEAM_M, _SLABS_A_BAY[lines]
    for storey in range(storeys):
        foot = storey * _STOREY_M
        under = foot + _STOREY_M - _SLAB_M - height
        for i in range(lines):
            for j in range(lines):
                x, y = i * _BAY_M, j * _BAY_M
                top = under
                yield "IfcColumn", f"C{storey}{i}{j}", (x - half, y - half, foot), (x + half, y + half, top)
        # Beams along x run over the column heads; those along y fit between them, on the columns' outer parts.
        for i in range(lines - 1):
            for j in range(lines):
                x0, x1, y = i * _BAY_M, (i + 1) * _BAY_M, j * _BAY_M
                low, high = (x0 + _GAP_M / 2, y - width / 2, under), (x1 - _GAP_M / 2, y + width / 2, under + height)
                yield "IfcBeam", f"X{storey}{i}{j}", low, high
        for i in range(lines):
            for j in range(lines - 1):
                x, y0, y1 = i * _BAY_M, j * _BAY_M + width / 2 + _GAP_M, (j + 1) * _BAY_M - width / 2 - _GAP_M
                low, high = (x - width / 2, y0, under), (x + width / 2, y1, under + height)
                yield "IfcBeam", f"Y{storey}{i}{j}", low, high
        for i in range(lines - 1):
            for j in range(lines - 1):
                for n in range(slabs):
                    span = _BAY_M / slabs
                    x, y0, y1 = i * _BAY_M + n * span, j * _BAY_M + _GAP_M / 2, (j + 1) * _BAY_M - _GAP_M / 2
                    low, high = (
                        (x + _GAP_M / 2, y0, under + height),
                        (x + span - _GAP_M / 2, y1, under + height + _SLAB_M),
                    )
                    yield "IfcSlab", f"S{storey}{i}{j}{n}", low, high
