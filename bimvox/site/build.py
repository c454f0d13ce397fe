"""Construction of the site value from the site file and the building's parts."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Element, Role
from bimvox.crane.outline import highest_point_m, mast_box_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame, Label, whole_cells
from bimvox.site.areas import NO_HOOK, NO_LOAD, columns_centred_in, columns_without, hook_heights
from bimvox.site.assign import assigned
from bimvox.site.casting import FIELD_CASTING
from bimvox.site.checks import (
    check_access,
    check_component,
    check_cranes,
    check_mast,
    check_samples,
    check_stands,
    check_yard,
    ground_of,
)
from bimvox.site.component import Component, IntVec, frozen
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.config.site_config import ComponentConfig, SiteConfig
from bimvox.site.crew_times import FIELD_TIMES
from bimvox.site.demand import means_by
from bimvox.site.flip_box import rise_to_flip_vox
from bimvox.site.ground import (
    Ground,
    cranes_on_ground,
    ground_cells,
    natural_ground_m,
    terrain_of,
)
from bimvox.site.lifting import hung
from bimvox.site.machine import moving_of
from bimvox.site.means import Means, nothing_to_lift
from bimvox.site.obstructions.cells import KINDS, Notes, Rasterise, Where, note_about, obstruction_cells
from bimvox.site.obstructions.many import blockers_of, cells_of_all
from bimvox.site.obstructions.obstruction_set import EMPTY, OTHER, Box, Obstruction, ObstructionSet, Rows
from bimvox.site.parts import component_of, entries_by_id, first_ids, order_hints
from bimvox.site.site import CRANE_ID, GROUND_ID, Blocker, Rules, Site, SwingRule, digest_of, mast_id, top_layers
from bimvox.site.tandem_choice import with_tandems
from bimvox.site.work import work_of

Parts = Sequence[tuple[Element, "NDArray[np.int32]"]]
"""Elements in the site frame, each with the (N, 3) int32 grid cells that it occupies."""


NOT_ITS_TERRAIN = (
    "the terrain of the model lies far above or below the building, so the ground is taken as flat; if the terrain is "
    "right, correct the heights in the model"
)


@dataclass(frozen=True, slots=True, eq=False)
class PlacedModel:
    """A building on the grid of its site.

    Attributes:
        parts: Its elements. Fittings are left out of the site; terrain is its ground.
        frame: Frame of the grid, from ``bimvox.site.placement.site_extent``.
        shape: (X, Y, Z) of the grid.
        site_to_ifc: (4, 4) transform from the site frame to model coordinates; None: identity.
        source: Plain values about the model, kept with the site.
        connections: Pairs of element ids that the building file connects.
    """

    parts: Parts
    frame: GridFrame
    shape: IntVec
    site_to_ifc: NDArray[np.float64] | None = None
    source: Mapping[str, str | float | bool] = field(default_factory=dict)
    connections: Sequence[tuple[str, str]] = ()


def build_site(
    config: SiteConfig,
    model: PlacedModel,
    *,
    cranes: Sequence[TowerCrane],
    rasterise: Rasterise,
    obstructions: ObstructionSet = EMPTY,
) -> Site:
    """Return the site of a building.

    Args:
        config: The site file, complete (see ``bimvox.site.guess.complete_config``).
        model: The building on the grid.
        cranes: From ``bimvox.site.machine.cranes_of``.
        rasterise: Turns the mesh of an obstruction into cells.
        obstructions: The current obstructions.

    Raises:
        ConfigError: If the site file does not fit the building; names the key.
        SelectionError: If there is nothing to lift.
    """
    frame, shape, rules = model.frame, model.shape, config.rules_in_force
    components, structure, notes = _sorted_out(config, model)
    if not any(component.means is Means.CRANE for component in components):
        raise nothing_to_lift(components)
    if cranes:
        check_samples(config, components)
    columns = (shape[0], shape[1])
    construction, yard, access = _areas(config, frame, columns)
    terrain = terrain_of(element for element, _ in model.parts)
    if not terrain and any(element.role is Role.GROUND for element, _ in model.parts):
        notes.append(NOT_ITS_TERRAIN)
    natural_m = natural_ground_m(frame, terrain, yard if access is None else yard | access)
    ground = Ground(frame, columns, natural_m, components)
    tops, spans = ground.tops(), ground.spanning()
    components = [replace(one, spans=over) if over else one for one, over in zip(components, spans, strict=True)]
    yard = level_yard(yard, tops)
    cranes = cranes_on_ground(config, cranes, frame, natural_m)
    check_cranes(config, cranes, rules.crane_separation_m)
    masts = _masts(config, cranes, model, components, rasterise)
    check_access(config)
    check_yard(config, yard, [one for one in components if one.means is Means.CRANE], tops, shape)
    if config.moves:
        check_stands(config, cranes, structure)
    blockers = (_ground(tops, shape), *structure, *masts)
    lifted = _on_their_slings(config, model, components, cranes, yard)
    prohibited, no_load = (columns_without(kinds, config.zone, frame, columns) for kinds in (NO_HOOK, NO_LOAD))
    site = Site(
        name=config.name or "site",
        frame=frame,
        labels=_labels(_slab(yard, construction), shape, [*_all_the_time(blockers, moves=config.moves)]),
        blockers=blockers,
        components=lifted,
        cranes=tuple(cranes),
        rules=rules,
        yard=frozen(yard),
        site_to_ifc=np.eye(4) if model.site_to_ifc is None else model.site_to_ifc,
        prohibited=frozen(prohibited),
        no_load=frozen(no_load),
        hook_heights=hook_heights(config.zone, frame, columns),
        natural_ground_m=frozen(natural_m),
        access=frozen(access),
        moving=moving_of(config, cranes),
        source=dict(model.source),
        notes=tuple(notes),
    )
    return with_obstructions(_with_fixed_digests(with_tandems(config, site)), obstructions, rasterise)


def _areas(
    config: SiteConfig, frame: GridFrame, columns: tuple[int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_] | None]:
    """Return the (X, Y) columns of the construction area, of the yard outside it, and of the access of trucks."""
    construction = columns_centred_in([config.areas.construction] if config.areas.construction else [], frame, columns)
    yard, access = ground_of(config.areas, frame, columns)
    return construction, yard & ~construction, access


def _on_their_slings(
    config: SiteConfig,
    model: PlacedModel,
    components: Sequence[Component],
    cranes: Sequence[TowerCrane],
    yard: NDArray[np.bool_],
) -> tuple[Component, ...]:
    """Return the components with their cranes and what they hang on."""
    elements = {element.id: element for element, _ in model.parts}
    gear, rules = gear_by_crane(config, len(cranes)), config.rules_in_force

    def on_its_slings(one: Component) -> Component:
        crane, own = (cranes[one.crane], gear[one.crane]) if cranes else (None, None)
        own = own if one.means is Means.CRANE else None
        return hung(one, elements[one.id], crane, rules.sling_angle_rad, model.frame, own)

    return tuple(map(on_its_slings, assigned(config, components, cranes, yard, model.frame, rules, on_its_slings)))


def level_yard(yard: NDArray[np.bool_], tops: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the columns of a yard in which nothing is dug out; ``tops`` are the highest layers of the ground."""
    result: NDArray[np.bool_] = yard & (tops == tops[yard].max(initial=0))
    return result


def _sorted_out(config: SiteConfig, model: PlacedModel) -> tuple[list[Component], list[Blocker], list[str]]:
    """Return what is lifted, what exists already, and notes about what is left out."""
    parts, frame = model.parts, model.frame
    entries = entries_by_id(config, (element for element, _ in parts))
    lifted = [e for e, _ in parts if e.role is Role.COMPONENT and not (e.id in entries and entries[e.id].pinned)]
    hints = order_hints(config, lifted, first_ids(config, lifted), model.connections)
    means = means_by(config, lifted, entries)
    components: list[Component] = []
    structure: list[Blocker] = []
    notes: list[str] = []
    for element, cells in parts:
        if element.id in means:
            check_component(config, element, cells, frame, model.shape)
            entry, number = entries.get(element.id), len(components)
            part = component_of(number, element, cells, entry, frame, hints[element.id], means[element.id])
            components.append(flipped(config, part, entry, frame.voxel_size_m))
        elif element.role in BUILT:
            if len(cells):
                structure.append(
                    Blocker(element.id, "structure", frozen(cells), element.mesh, element.name, element.ifc_class)
                )
            elif element.mesh.bounds_m[1, 2] > frame.origin_m[2]:  # nothing is set as deep as what lies below
                notes.append(left_out(element.id))
    if (programme := config.programme) is not None and config.sequence.schedule:
        notes += programme.notes_about(lifted)
    return components, structure, notes


def flipped(config: SiteConfig, part: Component, entry: ComponentConfig | None, voxel_size_m: float) -> Component:
    """Return a part with how far it is lifted before it is turned over between two hooks, if the site file asks.

    Raises:
        ConfigError: If it would lie so that it cannot be turned over.
    """
    rules = config.rules_in_force.two_hooks
    asked = (entry.flip if entry is not None else None) or config.rules.flip
    if rules is None or asked != "two_hooks" or not part.erected:
        return replace(part, flip_rise_vox=0) if part.flip_rise_vox else part
    rise_vox = rise_to_flip_vox(part, rules, voxel_size_m)
    if not rise_vox:
        raise config.error(
            "component.pose",
            f"{part.label} cannot be turned over between two hooks as it lies: it is not higher than it is thick",
            hint='with flip = "two_hooks" and without pose it comes lying flat; with a pose, give the turn in which it '
            'lies flat; flip = "foot" upends it about its foot',
        )
    return replace(part, flip_rise_vox=rise_vox)


def _masts(
    config: SiteConfig,
    cranes: Sequence[TowerCrane],
    model: PlacedModel,
    components: Sequence[Component],
    rasterise: Rasterise,
) -> Iterator[Blocker]:
    """Yield the masts that are inside the grid; none of them goes through a part."""
    for number, one in enumerate(cranes):
        mast = _mast(one, config.rules_in_force, model.frame, model.shape, rasterise, several=len(cranes) > 1)
        if mast is not None:
            if not config.moves:  # otherwise a part may be set there before or after
                check_mast(config, config.crane_key(number), mast, components, model.shape)
            yield mast


def _all_the_time(blockers: Sequence[Blocker], *, moves: bool) -> Iterator[Blocker]:
    """Yield the blockers that are there all the time: a crane that moves is not."""
    return (blocker for blocker in blockers if not (moves and blocker.kind == CRANE_ID))


def left_out(name: str) -> str:
    """Return the note about a structure outside the site's extent, by its id."""
    return f"{name}: existing structure outside the site's extent; it is left out"


def with_obstructions(site: Site, obstructions: ObstructionSet, rasterise: Rasterise) -> Site:
    """Return a site with these obstructions instead of its own; its geometry digest stays the same.

    An obstruction outside the site is left out, and one that sticks out is clipped, each with a note. If a part has the
    same id, the obstruction's id gets the prefix ``obstruction:``, so that the reason of a blocked lift is unambiguous.
    Very many obstructions share objects, see :func:`bimvox.site.obstructions.many.blockers_of`, and a note.
    """
    fixed = [blocker for blocker in site.blockers if blocker.kind != "obstruction"]
    taken = _taken(site)
    notes = Notes()

    def found() -> Iterator[tuple[str, NDArray[np.int32], bool]]:
        frame, shape, rows = site.frame, site.shape, Rows.of(obstructions.obstructions)
        grow_vox, inside = whole_cells(site.rules.clearance_m, frame.voxel_size_m), Where.INSIDE
        every = cells_of_all(rows, frame, shape, rasterise, grow_vox=grow_vox, ground_vox=site.ground_vox)
        for given, kind, (cells, where) in zip(rows.ids, rows.kinds.tolist(), every, strict=True):
            # A log does not carry the other files, so its proof looks for the notes about what is in them.
            name, is_other_file = _free_id(given, taken), kind == OTHER
            if where is not inside:
                notes.add(KINDS[where], partial(note_about, given, where, frame, shape), always=is_other_file)
            if name != given:
                notes.add("renamed", partial(renamed_note, given, name), always=is_other_file)
            yield name, cells, is_other_file

    added = blockers_of(found(), site.shape)
    return replace(
        site,
        labels=_labels(
            site.labels[:, :, 0], site.shape, [*_all_the_time(fixed, moves=site.moving is not None), *added]
        ),
        blockers=(*fixed, *added),
        obstruction_notes=(*obstructions.notes, *notes.lines()),
        digest=_digest(site.fixed_digest, added),
    )


def renamed_note(given: str, name: str) -> str:
    """Return the note about an obstruction that has another id on the site than in its file."""
    return f"obstruction {given!r} has the id of a part; it is renamed {name!r}"


def id_on_site(name: str, site: Site) -> str:
    """Return the id that an obstruction has on a site: its own, with a prefix if something else has the same."""
    return _free_id(name, _taken(site))


def _free_id(name: str, taken: Collection[str]) -> str:
    return f"obstruction:{name}" if name in taken else name


def _taken(site: Site) -> set[str]:
    """Return the ids of everything that a site has without obstructions."""
    fixed = (blocker.id for blocker in site.blockers if blocker.kind != "obstruction")
    return {*fixed, *(component.id for component in site.components)}


def ground_and_masts(site: Site, rasterise: Rasterise) -> tuple[Blocker, ...]:
    """Return the ground and the masts, as they follow from a site's shape, cranes and rules."""
    several = len(site.cranes) > 1
    masts = (_mast(crane, site.rules, site.frame, site.shape, rasterise, several=several) for crane in site.cranes)
    return (_ground(Ground.of(site).tops(), site.shape), *(mast for mast in masts if mast is not None))


def with_digests(site: Site) -> Site:
    """Return a site with its three digests computed anew."""
    fixed = _with_fixed_digests(site)
    added = [blocker for blocker in site.blockers if blocker.kind == "obstruction"]
    return replace(fixed, digest=_digest(fixed.fixed_digest, added))


def _digest(fixed_digest: str, added: Sequence[Blocker]) -> str:
    return digest_of("site 1", fixed_digest, [(blocker.id, blocker.cells) for blocker in added])


def _with_fixed_digests(site: Site) -> Site:
    blockers = [blocker for blocker in site.blockers if blocker.kind != "obstruction"]
    # The other cranes are hashed separately, so that a site with one crane keeps the digests of earlier versions.
    first, others = next(iter(site.cranes), None), site.cranes[1:]
    lifted_by = [component.crane for component in site.components]
    geometry = digest_of(
        "geometry 1",
        site.frame,
        site.shape,
        site.labels[:, :, 0],
        site.yard,
        site.prohibited,
        site.no_load,
        site.hook_heights,
        [blocker.cells for blocker in blockers[1:]],
        *([blockers[0].cells] if blockers[0].cells[:, 2].any() else []),
        [(c.shape.cells, c.target_vox, c.hook_offset_vox, c.erected, c.mass_kg) for c in site.components],
        replace(first, name="") if first else None,
        *([[replace(crane, name="") for crane in others], lifted_by] if others else []),
        [c.hook_aside_vox for c in site.components],
        *([[c.tandem for c in site.components]] if any(c.tandem for c in site.components) else []),
        *([site.rules.tandem] if any(c.tandem for c in site.components) else []),
        # A policy does not depend on log sampling, crew times, truck loads or stacks.
        replace(
            site.rules,
            sample_period_s=0.0,
            bracing_s=0.0,
            release_s=0.0,
            turn_s=0.0,
            upend_s=0.0,
            times=FIELD_TIMES,
            casting=FIELD_CASTING,
            truckload_kg=0.0,
            wind_speed_m_s=0.0,
            least_wind_m_s=0.0,
            gives_way=(),
            critical_share=0.0,
            swing=SwingRule.SHAPED,
            crane_separation_m=Rules().crane_separation_m,
            yard=None,
            props=None,
            two_hooks=None,
            tandem=None,
        ),
    )
    fixed = digest_of(
        "fixed 1",
        geometry,
        first,
        *([others] if others else []),
        site.rules,
        [
            [
                c.id,
                c.mesh,
                c.start_vox,
                c.stored_pose,
                c.stored_turn,
                c.before,
                c.after,
                c.hints,
                c.lifting,
                c.sail_area_m2,
            ]
            for c in site.components
        ],
        [work_of(component) for component in site.components],  # decides the crew's times
        *([[c.spans for c in site.components]] if any(c.spans for c in site.components) else []),
        *([[c.flip_rise_vox for c in site.components]] if any(c.flip_rise_vox for c in site.components) else []),
        [(blocker.id, blocker.kind, blocker.mesh) for blocker in blockers],
        site.site_to_ifc,
        *([] if site.access is None else [site.access]),
        *([] if site.moving is None else [site.moving]),
        *([] if site.natural_ground_m is None else [site.natural_ground_m]),
        site.source.get("sha256"),  # the file's name and the rest do not affect a plan
    )
    return replace(site, geometry_digest=geometry, fixed_digest=fixed)


def labels_of(site: Site) -> NDArray[np.uint8]:
    """Return the (X, Y, Z) labels that follow from a site's blockers, its yard and its construction area."""
    slab = _slab(site.yard, site.labels[:, :, 0] == Label.CONSTRUCTION_AREA)
    there = _all_the_time(site.blockers, moves=site.moving is not None)
    above = sorted(there, key=lambda blocker: (blocker.kind != "ground", blocker.kind == "obstruction"))
    return _labels(slab, site.shape, above)


def _slab(yard: NDArray[np.bool_], construction: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return the (X, Y) labels of the lowest layer."""
    slab = np.full(yard.shape, Label.GROUND, np.uint8)
    slab[yard] = Label.YARD
    slab[construction] = Label.CONSTRUCTION_AREA
    return slab


def _labels(slab: NDArray[np.uint8], shape: IntVec, blockers: Sequence[Blocker]) -> NDArray[np.uint8]:
    """Return the labels: blockers above the slab, obstructions over structures; the areas are on the ground too."""
    labels = np.zeros(shape, np.uint8)
    ground = blockers[0].cells
    labels[tuple(ground.T)] = Label.GROUND
    labels[*np.indices(shape[:2]), top_layers([ground], shape[:2])] = slab
    for blocker in blockers[1:]:
        label = Label.OBSTRUCTION if blocker.kind == "obstruction" else Label.STRUCTURE
        labels[tuple(blocker.cells.T)] = label
    labels[:, :, 0] = slab
    return frozen(labels)


def _ground(tops: NDArray[np.int32], shape: IntVec) -> Blocker:
    return Blocker(GROUND_ID, "ground", frozen(ground_cells(tops, shape)))


def _mast(
    crane: TowerCrane, rules: Rules, frame: GridFrame, shape: IntVec, rasterise: Rasterise, *, several: bool
) -> Blocker | None:
    """Return the mast from its foot to the top of the grid; None if it is outside the grid.

    With several cranes it ends at the crane's highest point, because another crane's jib may turn above it.
    """
    low, high = mast_box_m(crane)
    # Nothing is carried over a tower's mast. Above an undercarriage, the boom leaves no room.
    ends_m = highest_point_m(crane) if several else frame.origin_m[2] + shape[2] * frame.voxel_size_m
    top_m = high[2] if crane.luffing else max(high[2], ends_m)
    mast = Obstruction(mast_id(crane, several=several), Box(low, (high[0], high[1], top_m)))
    cells, _ = obstruction_cells(
        mast, frame, shape, rasterise, grow_vox=whole_cells(rules.clearance_m, frame.voxel_size_m)
    )
    return Blocker(mast.id, "crane", frozen(cells)) if len(cells) else None
