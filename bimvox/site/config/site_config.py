"""The schema of the site file. ``bimvox schema site`` prints it.

Everything except the path of the model is optional; :mod:`bimvox.site.guess` fills in what is missing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import shapely
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, PrivateAttr, Tag, model_validator

from bimvox.bim.kinds.kind import Correction, Kind, Way
from bimvox.bim.options import MOST_SELECT, ReadOptions
from bimvox.errors import ConfigError, shown
from bimvox.site.component import StoredPose
from bimvox.site.config.calendar import CalendarConfig, CostsConfig
from bimvox.site.config.crane import SET_UP_KEYS, CraneConfig
from bimvox.site.config.kind_file import corrections_in
from bimvox.site.config.project import MOST_SUPPORTS, ProjectConfig, SupportConfig
from bimvox.site.config.rules import RiggingConfig, RulesConfig, TandemConfig, TwoHooksConfig, YardConfig
from bimvox.site.config.validation import (
    A_FILE,
    ONE,
    SEVERAL,
    Flag,
    NotNegative,
    Number,
    Point2,
    Point2or3,
    Point3,
    Positive,
    Table,
    Text,
    Whole,
    not_below,
)
from bimvox.site.default_rules import (
    FEW_HANDS_KG,
    ROAD_HEIGHT_M,
    ROAD_KG,
    ROAD_LENGTH_M,
    ROAD_WIDTH_M,
)
from bimvox.site.programme import Programme, read_programme
from bimvox.site.site import Rules

KindName = Literal[
    "precast", "concrete", "masonry", "timber", "steel", "light", "glazing", "formwork", "pile", "earth", "other"
]
CellSize = Annotated[Positive, Field(le=100.0), AfterValidator(partial(not_below, 1e-3))]


def _simple_polygon(corners: tuple[Point2, ...]) -> tuple[Point2, ...]:
    """Return the corners; raise an error if the polygon has no area or crosses itself."""
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid:
        raise ValueError(f"not a simple polygon: {shapely.is_valid_reason(polygon)}")
    if polygon.area <= 0.0:
        raise ValueError("the polygon has no area")
    return corners


MOST_CORNERS = 10_000
MOST_AREAS = 1000
"""The most corners of a polygon, and the most zones and yard areas: no site needs more, and they would take minutes."""
Polygon = Annotated[tuple[Point2, ...], Field(min_length=3, max_length=MOST_CORNERS), AfterValidator(_simple_polygon)]
"""Corners [x, y] in site metres, in either direction, without repeating the first one."""


class KindConfig(Table):
    """What parts are and how they get to their places, whatever the model says."""

    select: Annotated[Text, Field(max_length=MOST_SELECT)]
    """Which parts: an IfcOpenShell query, or names of a mesh's bodies."""
    kind: KindName | None = None
    """What they are. Default: as the evidence in the model says."""
    means: Way | None = None
    """How they get to their places; ``out``: not part of the plan. Default: by kind, size and mass."""

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if self.kind is None and self.means is None:
            raise ValueError("it says nothing: give kind, means, or both")
        return self


def _file_or_table(given: object) -> str:
    return A_FILE if isinstance(given, str) else ONE


def _several(given: object) -> object:
    return (given,) if isinstance(given, str) else given


KindOrFile = Annotated[Annotated[Text, Tag(A_FILE)] | Annotated[KindConfig, Tag(ONE)], Discriminator(_file_or_table)]

_KINDS: Any = str | tuple[KindOrFile, ...]


class ModelConfig(Table):
    """The building model."""

    path: Path
    """IFC or mesh file, relative to the site file's folder."""
    select: Annotated[Text, Field(max_length=MOST_SELECT)] | None = Field(
        default=None, examples=["IfcColumn, IfcBeam, IfcSlab"]
    )
    """What is lifted: an IfcOpenShell query, or names of a mesh's bodies, such as ``column*, beam*``. Default: all
    prefabricated classes."""
    unit: Literal["m", "dm", "cm", "mm", "ft", "in"] | None = None
    """Length unit of a mesh file."""
    up: Literal["y", "z"] | None = None
    """Axis of a mesh file that points up. Default: of glTF y, otherwise z."""
    voxel_size_m: CellSize | None = None
    """Edge of a planning cell."""
    yaw_deg: Annotated[Number, Field(ge=-6e4, le=6e4)] = 0.0
    """Angle of the site's x axis in the model, counter-clockwise."""
    ground_m: Annotated[Number, Field(ge=-1e6, le=1e6)] | None = None
    """Height in the model of the top of the ground, the site's z = 0. Default: from terrain, storeys, foundations."""
    assemblies: Literal["whole", "parts"] = "whole"
    """How an assembly is lifted: ``whole``, or as its ``parts``."""
    kinds: Annotated[tuple[KindOrFile, ...], BeforeValidator(_several, json_schema_input_type=_KINDS)] = ()
    """What parts are if bimvox guesses wrongly: tables, and names of CSV files next to the site file, as ``bimvox
    inspect --csv`` writes them. Later ones count before earlier ones."""

    @property
    def yaw_rad(self) -> float:
        """``yaw_deg`` in radians."""
        return math.radians(self.yaw_deg)


class GridConfig(Table):
    """The extent of the site. Default: building, areas and crane, with a margin."""

    low_m: Point2or3 = Field(examples=[(0, 0)])
    """Lowest corner; a third value must be the lower side of the lowest cells."""
    high_m: Point3 = Field(examples=[(40, 30, 20)])
    """Highest corner."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if any(high <= low for low, high in zip((*self.low_m[:2], 0.0), self.high_m, strict=True)):
            raise ValueError("high_m must lie above low_m in x and y, and above 0 in z")
        return self


class AreasConfig(Table):
    """Polygons on the ground; cells whose centre lies inside belong to them."""

    construction: Polygon | None = None
    """Where the building is."""
    yard: Annotated[tuple[Polygon, ...], Field(min_length=1, max_length=MOST_AREAS)] | None = None
    """Where parts are stored, within the crane's reach and outside the construction area; they come in truckloads."""
    access: Annotated[tuple[Polygon, ...], Field(min_length=1, max_length=MOST_AREAS)] | None = None
    """Where trucks drive and stand: no part lies there, and the crane unloads every part from there. Default: not
    planned."""
    plot: Polygon | None = None
    """Ground that the jib may sweep over. A crane is chosen whose jib stays within; plans do not check it. Default:
    everywhere."""


def _one_or_several(given: object) -> str:
    return SEVERAL if isinstance(given, list | tuple) else ONE


class ComponentConfig(Table):
    """What differs from the defaults for one part. One that stands already has ``pinned = true`` alone."""

    global_id: Text
    """GlobalId of the part, or the body's name."""
    start: Point2or3 | None = Field(default=None, examples=[(12, -8)])
    """Lowest corner of the stored part. Default: planned."""
    pose: StoredPose | None = Field(default=None, examples=[StoredPose.AS_BUILT])
    """Stored as in the building, or lying along x or y, its foot at the lowest end, and upended before the lift."""
    turn: Annotated[Whole, Field(ge=0, le=3)] | None = Field(default=None, examples=[1])
    """Quarter turns of the stored part, counter-clockwise, after its ``pose``. Default: 0, or 1 if it fits only so."""
    flip: Literal["foot", "two_hooks"] | None = None
    """How it is upended. With ``two_hooks`` and without a ``pose``, it comes lying flat. Default: ``rules.flip``."""
    tandem: Flag | None = None
    """Whether two cranes carry it together. Default: with ``[rules.tandem]``, if none carries it alone."""
    before: tuple[Text, ...] = ()
    """Ids of parts that are set later."""
    after: tuple[Text, ...] = ()
    """Ids of parts that are set earlier."""
    pinned: Flag = False
    """Whether it stands already."""
    crane: Text | None = None
    """Which of several cranes lifts it. Default: chosen."""
    setup: Text | None = None
    """In which set-up of a crane that moves it is lifted. Default: chosen."""
    means: Way | None = Field(default=None, examples=["in_situ"])
    """Lifted by ``crane``, cast ``in_situ``, ``built`` by its trade, set ``by_hand``, or ``out`` of the plan. Default:
    by ``[means]``."""
    why: Text | None = None
    """Why ``means`` is so, where no person says it: init writes what it found. Remove it with ``means``."""
    kind: KindName | None = None
    """What it is. Default: as the evidence in the model says."""
    mass_kg: Annotated[Positive, Field(le=1e6)] | None = Field(default=None, examples=[2450])
    """What it weighs. Default: as the model states, otherwise by volume and material."""

    @model_validator(mode="after")
    def _liftable(self) -> Self:
        given = self.start or self.pose or self.turn or self.before or self.after or self.crane
        if self.pinned and (given or self.setup or self.means or self.kind or self.mass_kg or self.flip or self.tandem):
            raise ValueError(
                "a pinned part is not lifted: remove its start, pose, turn, flip, tandem, before, after, crane, setup, "
                "means, kind, mass_kg"
            )
        return self


class ZoneConfig(Table):
    """A zone on the plan (EN 17076), or one that is erected as a whole."""

    kind: Literal["prohibited", "no_load", "public", "slow", "limiter", "assembly"] = "prohibited"
    """``prohibited``: no hook above it; ``no_load``: no load above it; ``public``: neither; ``slow``: reduced rates;
    ``limiter``: the hook's heights. ``assembly``: parts whose centre lies in it are set together, zone by zone, all
    others last."""
    polygon: Polygon
    """Its corners."""
    name: Text | None = None
    """Its name."""
    share: Annotated[Number, Field(gt=0.0, le=1.0)] | None = None
    """``slow``: share of the highest rates. Default: 0.5."""
    lowest_hook_m: Number | None = None
    """``limiter``: lowest hook above z = 0."""
    highest_hook_m: Number | None = None
    """``limiter``: highest hook above z = 0."""

    @model_validator(mode="after")
    def _own_keys(self) -> Self:
        low, high = self.lowest_hook_m, self.highest_hook_m
        if self.kind != "slow" and self.share is not None:
            raise ValueError('share is only for kind = "slow"')
        if self.kind != "limiter" and (low is not None or high is not None):
            raise ValueError('lowest_hook_m and highest_hook_m are only for kind = "limiter"')
        if self.kind == "limiter" and low is None and high is None:
            raise ValueError("a limiter needs lowest_hook_m or highest_hook_m")
        if low is not None and high is not None and low >= high:
            raise ValueError("lowest_hook_m must be below highest_hook_m")
        return self


class MeansConfig(Table):
    """Beyond these limits of the road, concrete is cast in place, unless it is stated to be precast.

    ``means`` of a ``[[component]]`` decides for one part.
    """

    heaviest_kg: Positive = ROAD_KG
    """Its mass."""
    longest_m: Positive = ROAD_LENGTH_M
    """Its longest side."""
    widest_m: Positive = ROAD_WIDTH_M
    """Its second side."""
    highest_m: Positive = ROAD_HEIGHT_M
    """Its shortest side."""
    lift_from_kg: NotNegative = FEW_HANDS_KG
    """A lighter part is set by hand. 0: every part is a lift."""


Rank = Annotated[Whole, Field(ge=0, le=100)]


class RanksConfig(Table):
    """The order within a storey: lower ranks first, equal ranks in any order."""

    footing: Rank = 0
    """Piles and base slabs too."""
    column: Rank = 1
    """Upright slender parts."""
    wall: Rank = 1
    """Panels too."""
    beam: Rank = 2
    """Long parts."""
    slab: Rank = 3
    """Planks and roofs too."""
    stair: Rank = 3
    """Ramps and landings too."""
    other: Rank = 3
    """All other parts."""


class SequenceConfig(Table):
    """Wishes about the erection sequence, as far as geometry permits."""

    first: tuple[Text, ...] = ()
    """Ids of parts that are set first, with those that they need."""
    search: Flag = True
    """Whether a faster order than the greedy one is searched."""
    storeys: Flag = True
    """Whether storey follows storey."""
    ranks: RanksConfig = RanksConfig()
    """The order of the classes of parts."""
    schedule: Flag = True
    """Whether the order of the tasks is kept, those of the model or of ``programme``."""
    programme: Text | None = None
    """A programme next to the site file, Microsoft Project XML or Primavera XER; its tasks take the place of the
    model's."""


class PolicyConfig(Table):
    """The policy that proposes paths."""

    id: Text | None = Field(default=None, examples=["..."])
    """Id in the store. Default: the one trained for this site, otherwise greedy values."""
    steps: Annotated[Whole, Field(ge=1)] | None = Field(default=None, examples=[200_000])
    """Budget of the training, environment steps."""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """Seed of the training."""
    required_success: Annotated[Number, Field(gt=0.0, le=1.0)] = 1.0
    """Share of successful tests that ends the training."""


class SiteConfig(Table):
    """A site file. All but ``[model] path`` is optional and guessed.

    Lengths are in metres, in the site's frame: x and y as in the model, turned by ``yaw_deg``; z = 0 at the top of the
    ground.
    """

    _file: Path = PrivateAttr(default=Path("site.toml"))
    _machine_files: Mapping[str, bytes] = PrivateAttr(default_factory=dict)
    _programme_file: bytes | None = PrivateAttr(default=None)
    _programme_given: str | None = PrivateAttr(default=None)
    name: Text | None = None
    """Name of the site. Default: the file's."""
    coordinates: Literal["site", "map"] = "site"
    """``map``: areas, zones and the cranes' feet are [easting, northing] in metres, a foot's height that on the map, by
    the model's map conversion. All else stays in the site's frame."""
    project: ProjectConfig | None = None
    model: ModelConfig
    grid: GridConfig | None = None
    areas: AreasConfig = AreasConfig()
    crane: (
        Annotated[
            Annotated[CraneConfig, Tag(ONE)] | Annotated[tuple[CraneConfig, ...], Field(min_length=1), Tag(SEVERAL)],
            Discriminator(_one_or_several),
        ]
        | None
    ) = None
    rigging: RiggingConfig = RiggingConfig()
    component: tuple[ComponentConfig, ...] = ()
    zone: Annotated[tuple[ZoneConfig, ...], Field(max_length=MOST_AREAS)] = ()
    sequence: SequenceConfig = SequenceConfig()
    means: MeansConfig = MeansConfig()
    rules: RulesConfig = RulesConfig()
    yard: YardConfig | None = None
    calendar: CalendarConfig = CalendarConfig()
    costs: CostsConfig = CostsConfig()
    policy: PolicyConfig = PolicyConfig()
    support: Annotated[tuple[SupportConfig, ...], Field(max_length=MOST_SUPPORTS)] = ()

    @property
    def file(self) -> Path:
        """The file it was read from, for messages."""
        return self._file

    @property
    def machine_files(self) -> Mapping[str, bytes]:
        """The files of machines and gear that it names, by name: their bytes."""
        return self._machine_files

    def with_machine_files(self, files: Mapping[str, bytes]) -> SiteConfig:
        """Return it with more files of machines, by name: their bytes."""
        made = self.model_copy()
        made._machine_files = {**self._machine_files, **files}
        return made

    @property
    def kind_files(self) -> tuple[str, ...]:
        """The names of the files that say what parts are."""
        return tuple(one for one in self.model.kinds if isinstance(one, str))

    @property
    def corrections(self) -> tuple[Correction, ...]:
        """What the site file, its ``[[component]]`` tables and its files of kinds say of parts.

        Raises:
            ConfigError: If a file of kinds is missing or has a bad row.
        """
        found: list[Correction] = []
        for number, one in enumerate(self.model.kinds):
            if isinstance(one, str):
                found += corrections_in(self._machine_files.get(one), self._file.parent / one)
            else:
                kind = None if one.kind is None else Kind(one.kind)
                found.append(Correction(one.select, kind, one.means, f"{self._file}: model.kinds[{number}]"))
        for number, entry in enumerate(self.component):
            if entry.kind is not None or entry.means is not None or entry.mass_kg is not None:
                kind = None if entry.kind is None else Kind(entry.kind)
                where = f"{self._file}: component[{number}]"
                found.append(
                    Correction(entry.global_id, kind, entry.means, where, one_part=True, mass_kg=entry.mass_kg)
                )
        return tuple(found)

    def at_ground(self, ground_m: float) -> SiteConfig:
        """Return it with the ground at a height in the model; the rest stays as it is in the site's frame."""
        return self.model_copy(update={"model": self.model.model_copy(update={"ground_m": ground_m})})

    @property
    def read_options(self) -> ReadOptions:
        """How its model is read."""
        own = self.model
        return ReadOptions(own.select, own.unit, own.up, own.assemblies, corrections=self.corrections)

    @property
    def programme_name(self) -> str | None:
        """The name of the programme: the one given in the place of its own, otherwise the one that it names."""
        return self._programme_given or self.sequence.programme

    @property
    def programme_file(self) -> bytes | None:
        """The bytes of the programme."""
        return self._programme_file

    @property
    def programme(self) -> Programme | None:
        """The programme; None without one.

        Raises:
            ConfigError: If the file is missing, or is not a programme.
        """
        name = self.programme_name
        if name is None:
            return None
        if self._programme_file is None:
            raise self.error("sequence.programme", f"no such file: {name}", hint="put it next to the site file")
        return read_programme(self._programme_file, name, None if self._programme_given else self._file)

    @property
    def cranes(self) -> tuple[CraneConfig, ...]:
        """The tables of the cranes; of one that moves, a table for each set-up. Empty if a crane is to be chosen."""
        if self.crane is None:
            return ()
        return self.crane.at_set_ups() if isinstance(self.crane, CraneConfig) else self.crane

    @property
    def moves(self) -> bool:
        """Whether the cranes are the set-ups of one that moves."""
        return isinstance(self.crane, CraneConfig) and bool(self.crane.setup)

    def crane_key(self, number: int, key: str = "base_m") -> str:
        """Return the place in the file of a key of a crane: of the only one, of one of several, or of a set-up."""
        if self.moves:
            own = "boom_m" if key == "jib" else key
            return f"crane.setup[{number}].{own}" if key in SET_UP_KEYS else f"crane.{key}"
        return f"crane[{number}].{key}" if len(self.cranes) > 1 else f"crane.{key}"

    @property
    def rules_in_force(self) -> Rules:
        """The rules; their defaults depend on whether the site has a crane, or one is to be chosen for it."""
        given, asked = self.rules, any(one.flip == "two_hooks" for one in self.component)
        if asked and given.two_hooks is None:
            given = given.model_copy(update={"two_hooks": TwoHooksConfig()})
        if given.tandem is None and any(one.tandem for one in self.component):
            given = given.model_copy(update={"tandem": TandemConfig()})
        rules = given.rules(has_crane=any(crane.kind != "none" for crane in self.cranes) or self.crane is None)
        yard = None if self.yard is None else self.yard.rules()
        return replace(rules, yard=yard, order_search=self.sequence.search)

    @property
    def one_crane(self) -> CraneConfig | None:
        """The table of the (first) crane."""
        return self.cranes[0] if self.cranes else None

    def error(self, key: str | None, message: str, **more: Any) -> ConfigError:
        """Return an error about a key of this file."""
        return ConfigError(self._file, key, message, **more)

    @model_validator(mode="after")
    def _each_component_once(self) -> Self:
        first: dict[str, int] = {}
        for number, entry in enumerate(self.component):
            if first.setdefault(entry.global_id, number) != number:
                raise ValueError(f"component[{number}].global_id: {shown(entry.global_id)} is listed twice")
        return self

    @model_validator(mode="after")
    def _one_crane_turns_loads(self) -> Self:
        if self.rules.heading == "with_jib":
            if len(self.cranes) > 1 and not self.moves:
                raise ValueError(
                    f'rules.heading: "with_jib" is for one crane, but there are {len(self.cranes)}: with several, tag '
                    'lines keep the heading of loads; write "kept"'
                )
            if self.one_crane is not None and self.one_crane.kind == "none":
                raise ValueError('rules.heading: "with_jib" is for a site with a crane; write "kept"')
        return self

    @model_validator(mode="after")
    def _cranes_apart(self) -> Self:
        if isinstance(self.crane, tuple) and any(crane.setup for crane in self.crane):
            raise ValueError("crane: setup is for one crane that moves: several cranes stay where they are")
        if len(self.cranes) < 2 or self.moves:
            return self
        names: list[str] = []
        for number, crane in enumerate(self.cranes):
            key = f"crane[{number}]"
            if crane.kind == "none":
                raise ValueError(f'{key}.kind: "none" is for a site without a crane, but there are {len(self.cranes)}')
            if crane.name is None:
                raise ValueError(f"{key}.name is missing: each of several cranes needs its own name")
            if crane.name in names:
                raise ValueError(f"{key}.name: {crane.name!r} is also crane[{names.index(crane.name)}]'s name")
            if crane.base_m is None:
                raise ValueError(f"{key}.base_m is missing: give the position of {crane.name}")
            names.append(crane.name)
        return self
