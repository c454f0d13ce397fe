"""A precast building of three storeys: 2 x 2 bays of 6.0 x 5.4 m, a stair shaft, facades, footings."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from sample_models import prefab_kinds as kinds
from sample_models import prefab_shapes as shapes
from sample_models.ifc_author import IfcAuthor
from sample_models.ifc_entities import Vector
from sample_models.prefab_kinds import KINDS, Kind

BAYS = ((0, 0), (1, 0), (0, 1), (1, 1))
SHAFT_BAY = (1, 1)
SHAFT_MODULES = (1, 2)
SHAFT_X_M = shapes.LINES_X_M[1] + shapes.SLAB_MODULE_M + shapes.JOINT_M / 2
"""Outer face of the shaft's left wall: a joint next to the slab that ends there."""
SHAFT_END_X_M = SHAFT_X_M + 2 * shapes.SLAB_MODULE_M - shapes.JOINT_M
SHAFT_Y_M = 5.77
LANDING_X_M = (SHAFT_X_M + SHAFT_END_X_M - kinds.LANDING_WIDTH_M) / 2
LANDING_Y_M = shapes.LINES_Y_M[1] + shapes.COLUMN_M / 2 + shapes.GROUT_M
FLIGHT_FACE_M = LANDING_Y_M + kinds.FLOOR_LANDING_M
HALF_FACE_M = FLIGHT_FACE_M + shapes.FLIGHT_RUN_M
OUTSIDE_M = shapes.COLUMN_M / 2
"""From the outer grid lines to the outer faces of the columns."""
WINDOWS_M = ((0.9, 0.9, 1.5, 1.5), (3.79, 0.9, 1.5, 1.5))
"""x, z, width, height in a facade panel."""
DOOR_M = (3.94, 0.0, 1.2, 2.2)
GABLE_WINDOW_M = ((kinds.GABLE_LENGTH_M - 1.5) / 2, 0.9, 1.5, 1.5)

Opening = tuple[float, float, float, float]


def prefab_ifc() -> bytes:
    """Return the building as IFC4 in metres; z = 0 is the formation level, under the footings."""
    drawing = _Drawing()
    _grid(drawing)
    _footings(drawing)
    for storey in range(shapes.STOREYS):
        _columns(drawing, storey)
        _floor(drawing, storey + 1)
        _facades(drawing, storey)
        _shaft_walls(drawing, storey)
        if storey < shapes.STOREYS - 1:
            _stairs(drawing, storey)
    drawing.finish()
    return drawing.ifc.to_bytes("prefab.ifc")


class _Drawing:
    """The file being written, its storeys and types, and the placed products."""

    def __init__(self) -> None:
        ifc = self.ifc = IfcAuthor("prefab")
        site = ifc.spatial("IfcSite", "Site")
        building = ifc.spatial("IfcBuilding", "Building", (0, 0, shapes.GROUND_FLOOR_M), within=site)
        names = ("Ground floor", "First floor", "Second floor", "Roof")
        self.storeys = [ifc.storey(name, shapes.STOREY_M * i, within=building) for i, name in enumerate(names)]
        known = kinds.MATERIALS.items()
        self.materials = {name: ifc.material(name, said.category, said.density_kg_m3) for name, said in known}
        self._styles = {name: ifc.style(name, said.rgb) for name, said in known}
        self.types = {key: self._type(kind) for key, kind in KINDS.items()}
        self.placed: dict[str, list[Any]] = defaultdict(list)
        self._contents: dict[int, list[Any]] = defaultdict(list)

    def _type(self, kind: Kind) -> Any:
        solids = kind.solids(self.ifc)
        if kind.material is not None:
            self.ifc.paint(solids, self._styles[kind.material])
        more = {"PredefinedType": kind.predefined, **kind.more}
        return self.ifc.product_type(kind.ifc_class, kind.name, solids, **more)

    def keep(self, storey: int, product: Any) -> None:
        """Put a product without a type into a storey."""
        self._contents[storey].append(product)

    def put(self, key: str, storey: int, name: str, at_m: Vector, turns: int = 0, within: Any = None) -> Any:
        """Put a part of a type into a storey, or ``within`` a part of it; ``at_m`` is relative to that."""
        whole = within if within is not None else self.storeys[storey]
        part = self.ifc.occurrence(self.types[key], name, at_m, within=whole, quarter_turns=turns)
        self.placed[key].append(part)
        if within is None:
            self.keep(storey, part)
        return part

    def assembly(self, storey: int, name: str, at_m: Vector) -> Any:
        """Add an assembly, lifted in one piece."""
        whole = self.ifc.product(
            "IfcElementAssembly",
            name,
            at_m,
            within=self.storeys[storey],
            ObjectType="Stair unit",
            AssemblyPlace="FACTORY",
            PredefinedType="USERDEFINED",
        )
        self.keep(storey, whole)
        return whole

    def opening(self, panel: Any, name: str, thickness_m: float, opening: Opening) -> Any:
        """Cut an opening through a panel."""
        x, z, width, height = opening
        # Longer than the panel is thick, so that no face of it coincides with one of the panel's.
        over = 0.05
        low = -over if z == 0.0 else 0.0
        body = self.ifc.body_of([self.ifc.box((0, -over, low), (width, thickness_m + over, height))])
        void = self.ifc.product("IfcOpeningElement", name, (x, 0, z), within=panel, body=body, PredefinedType="OPENING")
        self.ifc.rooted("IfcRelVoidsElement", name, RelatingBuildingElement=panel, RelatedOpeningElement=void)
        return void

    def fill(
        self, void: Any, key: str, storey: int, name: str, thickness_m: float, size_m: tuple[float, float]
    ) -> None:
        """Put a window or a door into an opening."""
        part = self.put(key, storey, name, (0, thickness_m / 2, 0), within=void)
        part.OverallWidth, part.OverallHeight = size_m
        self.keep(storey, part)
        self.ifc.rooted("IfcRelFillsElement", name, RelatingOpeningElement=void, RelatedBuildingElement=part)

    def finish(self) -> None:
        """Add storeys, types, materials and weights."""
        for storey, products in sorted(self._contents.items()):
            self.ifc.contain(self.storeys[storey], products)
        made_of: dict[str, list[Any]] = defaultdict(list)
        for key, kind in KINDS.items():
            parts = self.placed[key]
            self.ifc.define_by_type(self.types[key], parts)
            mark = {"PieceMark": ("IfcLabel", kind.name.split()[0]), "TypeDesignator": ("IfcLabel", kind.name)}
            if kind.ifc_class not in ("IfcWindowType", "IfcDoorType", "IfcFootingType"):
                self.ifc.properties("Pset_PrecastConcreteElementGeneral", kind.name, parts, mark)
            if kind.material is None:
                continue
            # Half of the exporters give the material of the type, the other half that of the part.
            made_of[kind.material] += parts if kind.says_weight else [self.types[key]]
            if kind.quantities is not None and kind.volume_m3 is not None:
                weight = kind.volume_m3 * kinds.MATERIALS[kind.material].density_kg_m3 if kind.says_weight else None
                self.ifc.quantities(kind.quantities, kind.name, parts, volume_m3=kind.volume_m3, weight_kg=weight)
        for material, objects in made_of.items():
            self.ifc.made_of(self.materials[material], objects)


def _grid(drawing: _Drawing) -> None:
    """Add the grid of the drawing: a product without a body."""
    ifc, over = drawing.ifc, 2.0
    xs, ys = shapes.LINES_X_M, shapes.LINES_Y_M
    upright = [[(x, ys[0] - over), (x, ys[-1] + over)] for x in xs]
    level = [[(xs[0] - over, y), (xs[-1] + over, y)] for y in ys]
    curves = [ifc.polyline(points) for points in (*upright, *level)]
    tags = [*(_line(i) for i in range(len(xs))), *(str(j + 1) for j in range(len(ys)))]
    axes = [
        ifc.add("IfcGridAxis", AxisTag=tag, AxisCurve=curve, SameSense=True)
        for tag, curve in zip(tags, curves, strict=True)
    ]
    storey = drawing.storeys[0]
    lines = ifc.curves("FootPrint", curves)
    grid = ifc.product("IfcGrid", "Grid", within=storey, body=lines, UAxes=axes[: len(xs)], VAxes=axes[len(xs) :])
    drawing.keep(0, grid)


def _footings(drawing: _Drawing) -> None:
    xs, ys = shapes.LINES_X_M, shapes.LINES_Y_M
    for j, y in enumerate(ys):
        for i, x in enumerate(xs):
            drawing.put("pad", 0, f"Pad {_line(i)}{j + 1}", (x, y, 0))
    for i in (0, 1):
        for side, y in (("south", -0.5), ("north", ys[-1] + 0.1)):
            drawing.put("strip_x", 0, f"Strip {side} {i + 1}", (xs[i] + 0.6, y, 0))
        for side, x in (("west", 0.1), ("east", xs[-1] + 0.3)):
            drawing.put("strip_y", 0, f"Strip {side} {i + 1}", (x, ys[i] + 0.6, 0), 1)
    outer, inner = SHAFT_X_M + kinds.SHAFT_WALL_M, SHAFT_END_X_M - kinds.SHAFT_WALL_M + 0.4
    for side, x in (("left", outer), ("right", inner)):
        drawing.put("strip_shaft", 0, f"Strip shaft {side}", (x, SHAFT_Y_M - 0.07, 0), 1)
    drawing.put("stair_base", 0, "Stair base", (LANDING_X_M, FLIGHT_FACE_M - kinds.STAIR_BASE_M, 0))


def _columns(drawing: _Drawing, storey: int) -> None:
    for j, y in enumerate(shapes.LINES_Y_M):
        for i, x in enumerate(shapes.LINES_X_M):
            key = "column_middle" if i == 1 else "column_end"
            drawing.put(key, storey, f"Column {_line(i)}{j + 1}, storey {storey}", (x, y, 0), 2 if i == 2 else 0)


def _floor(drawing: _Drawing, floor: int) -> None:
    clear = shapes.COLUMN_M / 2 + shapes.GROUT_M
    for j, y in enumerate(shapes.LINES_Y_M):
        key = "beam_middle" if j == 1 else "beam_edge"
        for i in (0, 1):
            turns = 2 if j == 2 else 0
            x = shapes.LINES_X_M[i + 1] - clear if turns else shapes.LINES_X_M[i] + clear
            drawing.put(key, floor, f"Beam {j + 1} {_line(i)}-{_line(i + 1)}, floor {floor}", (x, y, 0), turns)
    roof = floor == shapes.STOREYS
    for i, j in BAYS:
        for module in range(shapes.MODULES):
            if (i, j) == SHAFT_BAY and module in SHAFT_MODULES and not roof:
                continue
            at = (shapes.LINES_X_M[i] + module * shapes.SLAB_MODULE_M, shapes.LINES_Y_M[j], 0)
            name = f"Slab {_line(i)}{j + 1}.{module + 1}, floor {floor}"
            drawing.put("roof_slab" if roof else "slab", floor, name, at)


def _facades(drawing: _Drawing, storey: int) -> None:
    xs, ys, z = shapes.LINES_X_M, shapes.LINES_Y_M, shapes.GROUT_M
    top = "_top" if storey == shapes.STOREYS - 1 else ""
    gap, far = OUTSIDE_M + shapes.GROUT_M, kinds.FACADE_LENGTH_M + 2 * shapes.JOINT_M
    # Panels are drawn with the outer face at y = 0, and turned to their side.
    for i in (0, 1):
        south = (xs[0] - OUTSIDE_M + i * far, ys[0] - gap - kinds.FACADE_M, z)
        north = (xs[-1] + OUTSIDE_M - i * far, ys[-1] + gap + kinds.FACADE_M, z)
        for side, at, turns in (("south", south, 0), ("north", north, 2)):
            name = f"Facade {side} {i + 1}, storey {storey}"
            panel = drawing.put(f"facade{top}", storey, name, at, turns)
            entrance = side == "south" and i == 0 and storey == 0
            for n, hole in enumerate((WINDOWS_M[0], DOOR_M if entrance else WINDOWS_M[1])):
                void = drawing.opening(panel, f"Opening {n + 1} in {name}", kinds.FACADE_M, hole)
                if side == "south":
                    key = "door" if hole is DOOR_M else "window"
                    drawing.fill(void, key, storey, f"Filling {n + 1} of {name}", kinds.FACADE_M, hole[2:])
    for i in (0, 1):
        west = (xs[0] - OUTSIDE_M, ys[i + 1] - gap, z)
        east = (xs[-1] + OUTSIDE_M, ys[i] + gap, z)
        for side, at, turns in (("west", west, 3), ("east", east, 1)):
            name = f"Gable {side} {i + 1}, storey {storey}"
            panel = drawing.put(f"gable{top}", storey, name, at, turns)
            drawing.opening(panel, f"Opening in {name}", kinds.GABLE_M, GABLE_WINDOW_M)


def _shaft_walls(drawing: _Drawing, storey: int) -> None:
    top = storey == shapes.STOREYS - 1
    left, right = ("shaft_top", "shaft_top") if top else ("shaft_left", "shaft_right")
    drawing.put(left, storey, f"Shaft wall left, storey {storey}", (SHAFT_X_M, SHAFT_Y_M, 0))
    x = SHAFT_END_X_M - kinds.SHAFT_WALL_M if top else SHAFT_END_X_M
    drawing.put(right, storey, f"Shaft wall right, storey {storey}", (x, SHAFT_Y_M, 0))


def _stairs(drawing: _Drawing, storey: int) -> None:
    """Add the stairs: lower flight and half landing are one lift, floor landing and upper flight are single lifts."""
    half = shapes.STOREY_M / 2
    gap = (kinds.LANDING_WIDTH_M - 2 * shapes.FLIGHT_WIDTH_M) / 2
    left, right = LANDING_X_M + gap / 2, LANDING_X_M + kinds.LANDING_WIDTH_M - gap / 2
    unit = drawing.assembly(storey, f"Stair unit, storey {storey}", (left, FLIGHT_FACE_M, 0))
    flight = drawing.put("flight", storey, f"Lower flight, storey {storey}", (0, 0, 0), within=unit)
    at = (LANDING_X_M + kinds.LANDING_WIDTH_M - left, shapes.FLIGHT_RUN_M + kinds.HALF_LANDING_M, half)
    landing = drawing.put("half_landing", storey, f"Half landing, storey {storey}", at, 2, within=unit)
    drawing.ifc.aggregate(unit, [flight, landing])
    drawing.put("floor_landing", storey + 1, f"Floor landing, floor {storey + 1}", (LANDING_X_M, LANDING_Y_M, 0))
    drawing.put("flight", storey, f"Upper flight, storey {storey}", (right, HALF_FACE_M, half), 2)


def _line(index: int) -> str:
    return "ABC"[index]
