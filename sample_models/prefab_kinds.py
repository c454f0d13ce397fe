"""The types of precast parts: geometry that every part of the type repeats, and the properties of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sample_models import prefab_shapes as shapes
from sample_models.ifc_author import IfcAuthor
from sample_models.ifc_entities import ACROSS_Y, ALONG_X, Vector

Solids = list[Any]

FACADE_LENGTH_M, FACADE_M = 6.19, 0.18
GABLE_LENGTH_M, GABLE_M = shapes.SLAB_LENGTH_M, 0.19
PARAPET_M = 0.40
PANEL_HEIGHT_M = shapes.STOREY_M - shapes.GROUT_M

SHAFT_WALL_LENGTH_M, SHAFT_WALL_M, BRACKET_M = 4.66, 0.15, 0.12
LANDING_WIDTH_M = 2.07
FLOOR_LANDING_M, HALF_LANDING_M = 1.38, 1.09
STAIR_BASE_M = FLOOR_LANDING_M - 0.15


@dataclass(frozen=True, slots=True)
class Material:
    """A material: its category, density and colour."""

    category: str
    density_kg_m3: float
    rgb: Vector


MATERIALS: Mapping[str, Material] = {
    "C50/60": Material("concrete", 2450.0, (0.62, 0.63, 0.64)),
    "C45/55": Material("concrete", 2450.0, (0.74, 0.74, 0.72)),
    "C35/45": Material("concrete", 2400.0, (0.68, 0.66, 0.62)),
    "LC25/28": Material("concrete", 1900.0, (0.85, 0.80, 0.70)),
    "C25/30": Material("concrete", 2400.0, (0.50, 0.50, 0.50)),
    "Timber and glass": Material("wood", 700.0, (0.45, 0.60, 0.70)),
}


@dataclass(frozen=True, slots=True)
class Kind:
    """One type of part.

    Attributes:
        ifc_class: Class of the type.
        name: Its name, also the piece mark.
        predefined: Its PredefinedType.
        solids: Draws its geometry.
        material: Its material; None if the drawing does not state it.
        quantities: Name of its quantity set, if it has one.
        volume_m3: Net volume of one part, if the drawing states it.
        says_weight: Whether the drawing also states the weight.
        more: Further attributes of the type.
    """

    ifc_class: str
    name: str
    predefined: str
    solids: Callable[[IfcAuthor], Solids]
    material: str | None
    quantities: str | None = None
    volume_m3: float | None = None
    says_weight: bool = False
    more: Mapping[str, Any] = field(default_factory=dict)


def _side(outline: shapes.Outline, width_m: float) -> Callable[[IfcAuthor], Solids]:
    """An outline in the x-z plane, ``width_m`` wide in y, symmetric about y = 0."""
    return lambda ifc: [ifc.extrusion(ifc.polygon(outline), width_m, (0, width_m / 2, 0), ACROSS_Y)]


def _along_x(outline: shapes.Outline, length_m: float) -> Callable[[IfcAuthor], Solids]:
    """An outline in the y-z plane, extruded from x = 0."""
    return lambda ifc: [ifc.extrusion(ifc.polygon(outline), length_m, (0, 0, 0), ALONG_X)]


def _box(size_m: Vector, low_m: Vector = (0, 0, 0)) -> Callable[[IfcAuthor], Solids]:
    x, y, z = low_m
    return lambda ifc: [ifc.box(low_m, (x + size_m[0], y + size_m[1], z + size_m[2]))]


def _slab(ifc: IfcAuthor) -> Solids:
    end = shapes.LINES_Y_M[1] - shapes.COLUMN_M / 2 - shapes.GROUT_M
    return [ifc.extrusion(ifc.polygon(*shapes.slab_section()), shapes.SLAB_LENGTH_M, (0, end, 0), ACROSS_Y)]


def _shaft_wall(side: int) -> Callable[[IfcAuthor], Solids]:
    """A wall of the stair shaft with its brackets towards +x (1) or -x (-1): below the half and the floor landing."""

    def solids(ifc: IfcAuthor) -> Solids:
        def bracket(top_m: float, from_m: float, to_m: float) -> Any:
            outline = [(side * x, z) for x, z in shapes.bracket_side(top_m, SHAFT_WALL_M, BRACKET_M)]
            return ifc.extrusion(ifc.polygon(outline[::side]), to_m - from_m, (0, to_m, 0), ACROSS_Y)

        low, high = sorted((0.0, side * SHAFT_WALL_M))
        under = shapes.SLAB_M + shapes.BEARING_M
        return [
            ifc.box((low, 0, shapes.GROUT_M), (high, SHAFT_WALL_LENGTH_M, shapes.STOREY_M)),
            bracket(shapes.STOREY_M / 2 - under, SHAFT_WALL_LENGTH_M - HALF_LANDING_M, SHAFT_WALL_LENGTH_M - 0.04),
            bracket(shapes.STOREY_M - under, 0.03, FLOOR_LANDING_M - 0.15),
        ]

    return solids


def _frame(width_m: float, height_m: float, bar_m: float) -> Callable[[IfcAuthor], Solids]:
    """A window or a glazed door in an opening of that size, 10 mm free all round."""

    def solids(ifc: IfcAuthor) -> Solids:
        low, high = (0.01, 0.01), (width_m - 0.01, height_m - 0.01)
        inner = shapes.rectangle((low[0] + bar_m, low[1] + bar_m), (high[0] - bar_m, high[1] - bar_m))
        frame = ifc.extrusion(ifc.polygon(shapes.rectangle(low, high), [inner]), 0.07, (0, 0.07, 0), ACROSS_Y)
        return [frame, ifc.extrusion(ifc.polygon(inner), 0.03, (0, 0.05, 0), ACROSS_Y)]

    return solids


def _column(name: str, corbels: tuple[int, ...]) -> Kind:
    outline = shapes.column_side(corbels)
    volume = shapes.area_m2(outline) * shapes.COLUMN_M
    solids = _side(outline, shapes.COLUMN_M)
    return Kind("IfcColumnType", name, "COLUMN", solids, "C50/60", "Qto_ColumnBaseQuantities", volume)


def _beam(name: str, predefined: str, ledges: tuple[int, ...]) -> Kind:
    outline = shapes.beam_section(ledges)
    volume = shapes.area_m2(outline) * shapes.BEAM_LENGTH_M
    solids = _along_x(outline, shapes.BEAM_LENGTH_M)
    return Kind("IfcBeamType", name, predefined, solids, "C50/60", "Qto_BeamBaseQuantities", volume, True)


def _hollow_core(name: str, predefined: str) -> Kind:
    outline, voids = shapes.slab_section()
    volume = (shapes.area_m2(outline) - sum(map(shapes.area_m2, voids))) * shapes.SLAB_LENGTH_M
    return Kind("IfcSlabType", name, predefined, _slab, "C45/55", "Qto_SlabBaseQuantities", volume, True)


def _panel(name: str, length_m: float, thickness_m: float, height_m: float) -> Kind:
    return Kind("IfcWallType", name, "SOLIDWALL", _box((length_m, thickness_m, height_m)), "LC25/28")


def _footing(name: str, predefined: str, solids: Callable[[IfcAuthor], Solids]) -> Kind:
    return Kind("IfcFootingType", name, predefined, solids, "C25/30")


def _strip(length_m: float) -> Callable[[IfcAuthor], Solids]:
    return _box((length_m, 0.4, shapes.GROUND_FLOOR_M), (0, 0, -shapes.GROUND_FLOOR_M))


KINDS: Mapping[str, Kind] = {
    "column_end": _column("C1 column, one corbel", (1,)),
    "column_middle": _column("C2 column, two corbels", (1, -1)),
    "beam_edge": _beam("B1 edge beam, one ledge", "BEAM", (1,)),
    "beam_middle": _beam("B2 inverted T-beam", "T_BEAM", (1, -1)),
    "slab": _hollow_core("S1 hollow-core slab", "FLOOR"),
    "roof_slab": _hollow_core("S2 hollow-core roof slab", "ROOF"),
    "facade": _panel("P1 facade panel", FACADE_LENGTH_M, FACADE_M, PANEL_HEIGHT_M),
    "facade_top": _panel("P2 facade panel with parapet", FACADE_LENGTH_M, FACADE_M, PANEL_HEIGHT_M + PARAPET_M),
    "gable": _panel("P3 gable panel", GABLE_LENGTH_M, GABLE_M, PANEL_HEIGHT_M),
    "gable_top": _panel("P4 gable panel with parapet", GABLE_LENGTH_M, GABLE_M, PANEL_HEIGHT_M + PARAPET_M),
    "shaft_left": Kind("IfcWallType", "W1 shaft wall, left", "SOLIDWALL", _shaft_wall(1), "C35/45"),
    "shaft_right": Kind("IfcWallType", "W2 shaft wall, right", "SOLIDWALL", _shaft_wall(-1), "C35/45"),
    "shaft_top": Kind(
        "IfcWallType",
        "W3 shaft wall, top storey",
        "SOLIDWALL",
        # It ends below the roof slabs and does not carry them.
        _box(
            (SHAFT_WALL_M, SHAFT_WALL_LENGTH_M, shapes.STOREY_M - shapes.SLAB_M - 2 * shapes.GROUT_M),
            (0, 0, shapes.GROUT_M),
        ),
        "C35/45",
    ),
    "flight": Kind(
        "IfcStairFlightType",
        "F1 flight of stairs",
        "STRAIGHT",
        _along_x(shapes.flight_side(), shapes.FLIGHT_WIDTH_M),
        "C35/45",
    ),
    # No material and no quantities: the planner must assume a density.
    "floor_landing": Kind(
        "IfcSlabType",
        "L1 floor landing",
        "LANDING",
        _along_x(shapes.landing_side(FLOOR_LANDING_M), LANDING_WIDTH_M),
        None,
    ),
    "half_landing": Kind(
        "IfcSlabType",
        "L2 half landing",
        "LANDING",
        _along_x(shapes.landing_side(HALF_LANDING_M), LANDING_WIDTH_M),
        None,
    ),
    "pad": _footing(
        "FD1 pad", "PAD_FOOTING", _box((1.2, 1.2, shapes.GROUND_FLOOR_M), (-0.6, -0.6, -shapes.GROUND_FLOOR_M))
    ),
    "strip_x": _footing("FD2 strip between pads along x", "STRIP_FOOTING", _strip(4.8)),
    "strip_y": _footing("FD3 strip between pads along y", "STRIP_FOOTING", _strip(4.2)),
    "strip_shaft": _footing("FD4 strip below a shaft wall", "STRIP_FOOTING", _strip(4.8)),
    "stair_base": _footing(
        "FD5 stair base",
        "PAD_FOOTING",
        _along_x(shapes.landing_side(STAIR_BASE_M, shapes.GROUND_FLOOR_M), LANDING_WIDTH_M),
    ),
    "window": Kind(
        "IfcWindowType",
        "Window 1500 x 1500",
        "WINDOW",
        _frame(1.5, 1.5, 0.06),
        "Timber and glass",
        more={"PartitioningType": "SINGLE_PANEL"},
    ),
    "door": Kind(
        "IfcDoorType",
        "Glazed door 1200 x 2200",
        "DOOR",
        _frame(1.2, 2.2, 0.10),
        "Timber and glass",
        more={"OperationType": "SINGLE_SWING_LEFT"},
    ),
}
