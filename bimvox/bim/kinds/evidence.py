"""The kind of a part, from what its source says of it: the strongest evidence first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import Casting, TriangleMesh, plain_class
from bimvox.bim.kinds.kind import UNKNOWN, Confidence, Judgement, Kind
from bimvox.bim.kinds.words import MODULE_CLASSES, Meaning, casting_by_name, is_barrier, machine_of, meaning_of
from bimvox.bim.own_box import own_sides_m, plan_sides_m
from bimvox.errors import shown

_SAID = {
    Kind.PRECAST: "precast concrete",
    Kind.CONCRETE: "concrete",
    Kind.LIGHT: "light construction",
    Kind.FORMWORK: "formwork or temporary works",
    Kind.PILE: "a pile",
}
_BY_TYPE = {
    ("IfcWall", "PARTITIONING"): Kind.LIGHT,
    ("IfcPlate", "CURTAIN_PANEL"): Kind.GLAZING,
    ("IfcMember", "MULLION"): Kind.LIGHT,
}
_BY_CLASS = {
    "IfcPile": Kind.PILE,
    "IfcFooting": Kind.CONCRETE,
    "IfcCovering": Kind.LIGHT,
    "IfcCurtainWall": Kind.LIGHT,
    "IfcEarthworksElement": Kind.EARTH,
    "IfcEarthworksFill": Kind.EARTH,
    "IfcCourse": Kind.EARTH,
}
_PLANES = ("IfcSlab", "IfcRoof")
"""Of joists or rafters, they are built of pieces; of solid timber, they come in one piece."""
_SHORTEST_WORD = 4
"""Words of materials this short say nothing in the name of a part, where they may be anything."""
_THIN_WALL_M = 0.13
"""A wall up to this thick of which nothing is known is a partition."""
_THIN_BAR_M = 0.12
"""A bar of concrete is thicker, for its reinforcement and cover."""
_THIN_BOARD_M = 0.06
"""So is any beam, column or member, however short: stringers, fascias, planks."""
_SLENDER = 10.0
_BOARD_M = 0.045
"""A plane of timber up to this thick is of boards."""
_STEEL_PLATE_M = 3.0
"""A plane of steel wider than any plate is of sheets, panels or gratings."""
_FLAT = 0.995
"""Cosine of the slope, 1 in 10, up to which a face is flat; one as close to upright is a side."""
_STAIRS = ("IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight")
"""Stone in their names is that of the treads."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What a source says of a part.

    Attributes:
        ifc_class: For example ``IfcWall``.
        names: Of the part, its type and its object type; None where it has none.
        layers: Names of its materials with their thickness or share.
        mesh: Its triangles.
        predefined_type: In capitals, if any.
        casting: How its properties state that it is cast, if they do.
        classes: Names of its classifications.
    """

    ifc_class: str
    names: Sequence[str | None]
    layers: Sequence[tuple[str, float]]
    mesh: TriangleMesh
    predefined_type: str | None = None
    casting: Casting | None = None
    classes: Sequence[str] = ()

    @property
    def plain_class(self) -> str:
        """The class without its variants of IFC2X3."""
        return plain_class(self.ifc_class)


def judge(facts: Facts) -> tuple[Judgement, Casting | None]:
    """Return what a part is, and how it is cast if that is said.

    Formwork is what is called so. Of all others decide: properties and classifications, the materials (of layers, the
    kind that weighs most), what the name and the type call it, its predefined type and class, words of materials in its
    name, its shape.
    """
    called = _called_by(facts.names)
    if called is not None and called.says == Kind.FORMWORK:
        return _judged(Kind.FORMWORK, Confidence.NAMED, _in_name(called)), None
    casting, casting_words = _casting(facts)
    if called is not None and called.says == "module" and facts.plain_class in MODULE_CLASSES:
        return Judgement(Kind.PRECAST, Confidence.NAMED, f"{_in_name(called)} says {called.name}"), Casting.PRECAST
    found = next(_evidence(facts, called), UNKNOWN)
    machine = machine_of(facts.ifc_class, facts.names)
    is_known = found.kind in (Kind.CONCRETE, Kind.PRECAST) and found.confidence is not Confidence.ASSUMED
    if machine is not None and casting is None and not is_known:
        why = f"{shown(machine.word)} in its name or class says {machine.name}, which come in one piece"
        return Judgement(Kind.OTHER, Confidence.ASSUMED, why), Casting.PRECAST
    if facts.plain_class in _PLANES and found.kind is Kind.TIMBER and called is not None and called.says == Kind.TIMBER:
        why = f"{_in_name(called)} says a floor or a roof of pieces of timber"
        found = Judgement(Kind.LIGHT, found.confidence, why)
    if (layers := _of_thin_layers(facts, found, called)) is not None:
        found = layers
    if called is not None and called.casting is not None and casting is None:
        casting = Casting(called.casting)
        why = f"{_in_name(called)} says {called.name}, made in place"
        return Judgement(Kind.CONCRETE, Confidence.NAMED, why), casting
    is_concrete = found.kind in (Kind.CONCRETE, Kind.OTHER)
    is_guess = facts.casting is not None and found.confidence is Confidence.ASSUMED
    if casting is Casting.PRECAST and (is_concrete or is_guess or found.kind is Kind.MASONRY):
        return _cast(Kind.PRECAST, facts, casting_words, "is precast"), casting
    if casting is Casting.IN_SITU and is_concrete:
        return _cast(Kind.CONCRETE, facts, casting_words, "is cast in place"), casting
    if is_concrete and casting is None and called is not None and called.says == "footing":
        why = f"{_in_name(called)} says that it is a footing"
        return Judgement(Kind.CONCRETE, Confidence.NAMED, why), Casting.IN_SITU
    return found, casting


def _of_thin_layers(facts: Facts, found: Judgement, called: Meaning | None) -> Judgement | None:
    """Return that a plane of timber or steel is built of boards, sheets or panels; None if it comes in one piece."""
    if found.kind not in (Kind.TIMBER, Kind.STEEL) or found.confidence is Confidence.STATED:
        return None
    if facts.plain_class not in (*_PLANES, "IfcWall"):
        return None
    if called is not None and called.says == Kind.LIGHT:
        return _judged(Kind.LIGHT, found.confidence, _in_name(called))
    thin_m, width_m, _ = own_sides_m(facts.mesh)
    if found.kind is Kind.TIMBER and thin_m <= _BOARD_M:
        why = f"a plane of timber {1e3 * thin_m:.0f} mm thick is taken as boards"
    elif found.kind is Kind.STEEL and width_m > _STEEL_PLATE_M:
        why = f"a plane of steel {width_m:.1f} m wide is taken as sheets or panels"
    elif found.kind is Kind.STEEL and len(facts.layers) > 1:
        why = "a plane of steel with other layers is taken as sheets or panels"
    else:
        return None
    return Judgement(Kind.LIGHT, Confidence.ASSUMED, why)


def casting_of(kind: Kind, casting: Casting | None) -> Casting | None:
    """Return how a part is cast of which a person says the kind; ``casting``: how its source says that it is."""
    if kind is Kind.PRECAST:
        return Casting.PRECAST
    return Casting.IN_SITU if kind is Kind.CONCRETE and casting is Casting.IN_SITU else None


def _evidence(facts: Facts, called: Meaning | None) -> Iterator[Judgement]:
    """Yield what each evidence says, the strongest first."""
    for text in facts.classes:
        if (meaning := meaning_of(text)) is not None and meaning.kind is not None:
            yield _judged(meaning.kind, Confidence.STATED, f"its classification {shown(text)}")
    if (by_material := _by_layers(facts.layers)) is not None:
        kind, name = by_material
        yield _judged(kind, Confidence.NAMED, f"its material {shown(name)}")
    if called is not None and called.kind not in (None, Kind.PILE):
        yield _judged(Kind(called.says), Confidence.ASSUMED, _in_name(called))
    by_type = _BY_TYPE.get((facts.plain_class, facts.predefined_type or ""))
    if by_type is not None:
        yield _judged(by_type, Confidence.NAMED, f"its predefined type {facts.predefined_type}")
    by_class = _BY_CLASS.get(facts.plain_class)
    if by_class is not None:
        yield _judged(by_class, Confidence.NAMED, f"its class {facts.ifc_class}")
    by_shape = _by_shape(facts)
    cannot_be = {Kind.CONCRETE} if by_shape is not None and by_shape.kind is Kind.TIMBER else set()
    cannot_be |= {Kind.MASONRY} if facts.plain_class in _STAIRS else set()
    for text in filter(None, facts.names):
        meaning = meaning_of(text, shortest=_SHORTEST_WORD)
        if meaning is not None and meaning.kind not in (None, Kind.EARTH, *cannot_be):
            yield _judged(Kind(meaning.says), Confidence.ASSUMED, _in_name(meaning))
    if by_shape is not None:
        yield by_shape


def _judged(kind: Kind, confidence: Confidence, evidence: str) -> Judgement:
    return Judgement(kind, confidence, f"{evidence} says {_SAID.get(kind, kind.value)}")


def _cast(kind: Kind, facts: Facts, words: str, what: str) -> Judgement:
    """Return the judgement of a part that is said to be cast somewhere; ``words``: where it is said."""
    if facts.casting is not None:
        return Judgement(kind, Confidence.STATED, f"its properties state that it {what}")
    return Judgement(kind, Confidence.NAMED, f"{shown(words)} says that it {what}")


def _in_name(meaning: Meaning) -> str:
    return f"{shown(meaning.word)} in its name"


def _called_by(names: Sequence[str | None]) -> Meaning | None:
    """Return what the names call a part; formwork before all else."""
    found = [meaning for name in filter(None, names) if (meaning := meaning_of(name, "part")) is not None]
    return next((one for one in found if one.says == Kind.FORMWORK), found[0] if found else None)


def _casting(facts: Facts) -> tuple[Casting | None, str]:
    """Return how a part is cast, by its properties, otherwise by words; and those words."""
    if facts.casting is not None:
        return facts.casting, ""
    texts = [*(name for name, _ in facts.layers), *filter(None, facts.names)]
    joined = " ; ".join(texts)
    casting = casting_by_name(joined)
    words = next((text for text in texts if casting_by_name(text) is casting), joined)
    return casting, words


def _by_layers(layers: Sequence[tuple[str, float]]) -> tuple[Kind, str] | None:
    """Return the kind whose layers weigh most, and the name of the heaviest of them; None if no name says anything."""
    weights: dict[Kind, dict[str, float]] = {}
    for name, thickness in layers:
        meaning = meaning_of(name)
        if meaning is not None and meaning.kind is not None:
            of_kind = weights.setdefault(meaning.kind, {})
            of_kind[name] = of_kind.get(name, 0.0) + max(thickness, 1e-9) * (meaning.kg_m3 or 0.0)
    if not weights:
        return None
    kind = max(weights, key=lambda one: sum(weights[one].values()))
    return kind, max(weights[kind], key=lambda name: weights[kind][name])


def _by_shape(facts: Facts) -> Judgement | None:
    """Return what the shape of a part says of which nothing else is known; None if it says nothing."""
    short_m, middle_m, long_m = own_sides_m(facts.mesh)
    is_thin_wall = facts.plain_class == "IfcWall" and short_m <= _THIN_WALL_M
    if is_thin_wall and not is_barrier(facts.ifc_class, facts.names):
        return Judgement(Kind.LIGHT, Confidence.ASSUMED, f"a wall {1e3 * short_m:.0f} mm thick is taken as a partition")
    if facts.plain_class in ("IfcBeam", "IfcMember", "IfcColumn"):
        is_slender = long_m >= _SLENDER * middle_m and short_m < _THIN_BAR_M
        if is_slender or short_m < _THIN_BOARD_M:
            return Judgement(
                Kind.TIMBER, Confidence.ASSUMED, f"a bar {1e3 * short_m:.0f} mm thick is too thin for concrete"
            )
    is_roof = facts.plain_class == "IfcSlab" and "ROOF" in (facts.predefined_type or "")
    if (is_roof or facts.plain_class == "IfcRoof") and _is_inclined(facts.mesh):
        return Judgement(Kind.LIGHT, Confidence.ASSUMED, "an inclined roof plane is taken as a covered roof structure")
    return None


def _is_inclined(mesh: TriangleMesh) -> bool:
    """Return whether more of a roof slopes than is flat: one plane, both of a gable, with dormers or without."""
    a, b, c = np.moveaxis(mesh.triangles_m, 1, 0)
    normals = np.cross(b - a, c - a)
    areas, up = np.linalg.norm(normals, axis=1), np.abs(normals[:, 2])
    is_flat, is_side = up >= _FLAT * areas, up <= (1.0 - _FLAT) * areas
    return float(areas[~is_flat & ~is_side].sum()) > float(areas[is_flat].sum())


_SOLID = 0.9
"""Least share of its convex hull that a part without its voids is."""
_OF_MACHINE = 0.3
"""A machine of metal that fills more of its convex hull is no vessel as it is."""
_STAIR_CLASSES = frozenset({"IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight"})
_FRAME_CLASSES = MODULE_CLASSES | {"IfcBeam", "IfcMember", "IfcColumn"}
_METAL_KG_M3, _CONCRETE_KG_M3 = 2650.0, 1500.0
"""Densities above which a part is of metal, and of concrete or stone; below, it is of timber."""
_SOLID_FLIGHT_M = 0.45
"""A flight that is thicker on average is drawn solid: plates with steps are 0.17 to 0.3 m thick."""
_NARROWEST_M, _LOWEST_M = 0.5, 0.6
"""A flight is at least so wide, and more than a few block steps so high; a stringer is narrower."""
_FLIGHT_M = {"metal": 0.014, "concrete": 0.28, "timber": 0.08}
"""Volume of a flight per area of its slope, a little above that of products: a waist of 0.2 m and half a step of
concrete, 110 kg/m2 of steel, 40 kg/m2 of timber (professional judgement)."""
_FRAME_M = 0.5
"""Frames are at least so high; so a chord that has the name of its truss is none."""
_FRAME_SLENDER = 4.0
"""And so many times as high as wide, if they are not as high as a space frame."""
_SPACE_FRAME_M = 1.0
_BARS = 3.2
"""Cross sections of bars in one of a plane frame: two chords, and webs that weigh a little more than one."""
_BAR_OF_HEIGHT = 8.0
"""No bar is thicker than the height of its frame over this."""
_HOLLOW_BAR = 0.15
"""Share of steel in the square around a rolled or hollow section."""
_TIMBER_BAR_M = 0.2
"""Bars of timber are so deep, however thin."""


def solid_share(
    ifc_class: str,
    names: Sequence[str | None],
    predefined_type: str | None,
    mesh: TriangleMesh,
    volume_m3: float,
    kg_m3: float,
    *,
    is_assumed: bool = False,
) -> float | None:
    """Return how much of its volume a part is that is drawn as one solid block; None if it is all of it.

    Of a machine of unknown material it may be more: it is drawn as a hull of sheets.

    Args:
        ifc_class: Its class.
        names: Of the part, its type and its object type.
        predefined_type: In capitals, if any.
        mesh: Its triangles.
        volume_m3: The volume that they enclose.
        kg_m3: Density of its material.
        is_assumed: Whether that is an assumption.
    """
    plain = plain_class(ifc_class)
    if (machine := machine_of(ifc_class, names)) is not None and machine.kg_m3 is not None:
        hull_m3 = _hull_m3(mesh)
        is_block = is_assumed or (kg_m3 > _METAL_KG_M3 and volume_m3 > _OF_MACHINE * hull_m3)
        return machine.kg_m3 * hull_m3 / (volume_m3 * kg_m3) if is_block and hull_m3 else None
    what = _shape_by_name(names)
    if plain in _STAIR_CLASSES or (what == "stairs" and plain in MODULE_CLASSES | {"IfcSlab"}):
        return _share_of_flight(mesh, volume_m3, kg_m3)
    if plain in _FRAME_CLASSES and (what == "frame" or predefined_type == "TRUSS"):
        return _share_of_frame(mesh, volume_m3, kg_m3)
    meaning = meaning_of("hollow core", "part") if predefined_type == "HOLLOWCORE" else _called_by(names)
    if meaning is None or meaning.share is None or (meaning.says == "module" and plain not in MODULE_CLASSES):
        return None
    return meaning.share if _is_solid(mesh, volume_m3) else None


def _shape_by_name(names: Sequence[str | None]) -> str | None:
    found = (meaning_of(name, "shape") for name in names if name)
    return next((meaning.says for meaning in found if meaning is not None), None)


def _share_of_flight(mesh: TriangleMesh, volume_m3: float, kg_m3: float) -> float | None:
    """Return the share of a plate with steps as long as the slope in a flight that is much thicker."""
    width_m, run_m = plan_sides_m(mesh)
    rise_m = float(np.ptp(mesh.bounds_m[:, 2]))
    slope_m2 = width_m * float(np.hypot(run_m, rise_m))
    if width_m < _NARROWEST_M or rise_m < _LOWEST_M or volume_m3 <= _SOLID_FLIGHT_M * slope_m2:
        return None
    return _FLIGHT_M[_stuff(kg_m3)] * slope_m2 / volume_m3


def _share_of_frame(mesh: TriangleMesh, volume_m3: float, kg_m3: float) -> float | None:
    """Return the share of chords and webs in the plate or block that a frame is drawn as."""
    width_m, height_m, _ = own_sides_m(mesh)
    if height_m < max(_FRAME_M, min(_FRAME_SLENDER * width_m, _SPACE_FRAME_M)) or not _is_solid(mesh, volume_m3):
        return None
    bar_m = min(width_m, height_m / _BAR_OF_HEIGHT)
    planes = 1 if bar_m == width_m else 2
    stuff = _stuff(kg_m3)
    deep_m = max(bar_m, _TIMBER_BAR_M) if stuff == "timber" else bar_m
    share = _BARS * planes * bar_m * deep_m * (_HOLLOW_BAR if stuff == "metal" else 1.0) / (width_m * height_m)
    return share if share < 1.0 else None


def _stuff(kg_m3: float) -> str:
    return "metal" if kg_m3 > _METAL_KG_M3 else "concrete" if kg_m3 >= _CONCRETE_KG_M3 else "timber"


def _is_solid(mesh: TriangleMesh, volume_m3: float) -> bool:
    """Return whether a part fills its convex hull."""
    return 0.0 < _SOLID * _hull_m3(mesh) <= volume_m3


def _hull_m3(mesh: TriangleMesh) -> float:
    """Return the volume of the convex hull of a mesh; 0 if it is flat."""
    try:
        return float(ConvexHull(mesh.vertices_m[np.unique(mesh.faces)]).volume)
    except (QhullError, ValueError):
        return 0.0
