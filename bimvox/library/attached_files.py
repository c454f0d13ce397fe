"""Compares the site that a log claims with the files that it carries, completed as the parts in the log say.

Both files are read again. What follows from them and from the parts in the log is compared: rules, cranes, zones,
areas, cells, what each part's table asks for, obstructions. What the site file leaves to be chosen is chosen again.
Ground and masts follow from the site itself.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.errors import BimvoxError, InputError
from bimvox.files import scratch_folder
from bimvox.grid.frame import GridFrame, Label
from bimvox.library.compare import (
    compare_held,
    compare_parts,
    compare_pinned,
    equal,
    same,
    same_blockers,
    same_cranes,
    same_rules,
)
from bimvox.library.hand_over import as_assigned
from bimvox.library.site import (
    KINDS,
    LISTED,
    MACHINE,
    OBSTRUCTIONS,
    attached_as,
    load_obstructions,
    rasterise,
    survey_in,
)
from bimvox.log.plan_json import HELD_CRANES_FILE, HELD_FILE
from bimvox.log.plan_log import GEOREFERENCE, PlanLog, attached_programme
from bimvox.records.motion import TRACKS
from bimvox.records.proof import Check
from bimvox.site.areas import NO_HOOK, NO_LOAD, columns_centred_in, columns_without, hook_heights
from bimvox.site.build import ground_and_masts, id_on_site, labels_of, level_yard, renamed_note, with_obstructions
from bimvox.site.checks import ground_of
from bimvox.site.component import Component, IntVec
from bimvox.site.config.file import SITE_FILE, named_files, parse_site_config
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.ground import cranes_on_ground
from bimvox.site.guess import complete_with_placed, lifted_of
from bimvox.site.machine import cranes_of, moving_of
from bimvox.site.map_frame import map_of_model, on_site
from bimvox.site.obstructions.cells import Where, note_about
from bimvox.site.obstructions.coordinates import is_about_coordinates
from bimvox.site.obstructions.file import without_references
from bimvox.site.placement import site_extent, with_room_for_slings
from bimvox.site.programme import ATTACHED
from bimvox.site.site import HookHeights, Site

_OF_ELEMENT = (
    *("id", "global_id", "ifc_class", "name", "mesh", "mass_kg", "mass_source", "storey", "material"),
    *("predefined_type", "casting", "volume_guessed", "judgement", "stated_means", "doubted_kg"),
)
"""What a component has from its element unchanged, as far as a site file may ask for it."""
_COPY = "#"
"""Separates the GlobalId from the rest of the id of a part whose GlobalId occurs more than once."""


def building_of(site: Site, config: SiteConfig) -> Building:
    """Return the building of a site, in the site frame: parts and structure.

    Of structure only id and surface are known. What the site file pins is a component that is not lifted.
    """
    pinned = {entry.global_id for entry in config.component if entry.pinned}
    fixed = [_fixed(one.id, one.mesh, pinned) for one in site.blockers if one.kind == "structure" and one.mesh]
    lifted = [_lifted(component) for component in site.components]
    return Building((*lifted, *fixed), (), Source("", "", "", "m"))


def completed(config: SiteConfig, site: Site, building: Building) -> SiteConfig:
    """Return a site file with areas, crane and cell size filled in, as they follow from the parts of a site.

    The height of the ground in the model, if the file leaves it out, is the site's: only the model says more.

    Raises:
        BimvoxError: If nothing can be chosen for these parts.
    """
    if config.model.ground_m is None:
        config = config.at_ground(float(site.site_to_ifc[2, 3]))
    return complete_with_placed(config, building, lifted_of(config, building))


def _lifted(component: Component) -> Element:
    hints = component.hints
    return Element(
        **{name: getattr(component, name) for name in _OF_ELEMENT},
        role=Role.COMPONENT,
        assembly=hints.assembly,
        task=hints.task,
        task_rank=hints.task_rank,
    )


def _fixed(name: str, mesh: TriangleMesh, pinned: set[str]) -> Element:
    global_id = name if name in pinned else name.rpartition(_COPY)[0] or name
    role = Role.COMPONENT if global_id in pinned else Role.STRUCTURE
    return Element(name, global_id, "", name, mesh, role, 0.0, "")


_SAME = 1e-9


def check_attached_files(log: PlanLog) -> Check:
    """Check that the files attached to a log give the rules, cranes, zones, areas and obstructions of its site."""
    check = Check("own_files")
    site, known = log.plan.site, {SITE_FILE, HELD_FILE, HELD_CRANES_FILE}
    fixed = [blocker for blocker in site.blockers if blocker.kind in ("ground", "crane")]
    same_blockers(check, fixed, ground_and_masts(site, rasterise), "what follows from the site's shape and cranes")
    _same_labels(check, site)
    if (text := log.attachments.get(SITE_FILE)) is None:
        check.look(False, f"it carries no {SITE_FILE}, so nothing says for which rules and crane it was planned")
    else:
        try:
            config = _config_of(log, text)
            compare_config(check, as_assigned(log.plan), config, f"the attached {SITE_FILE}")
            known |= {MACHINE + name for name in named_files(config)}
            known |= {ATTACHED + name for name in (config.programme_name,) if name is not None}
        except (BimvoxError, UnicodeDecodeError) as error:
            check.look(False, f"the attached {SITE_FILE} cannot be used: {error}")
    listed = [name for name in sorted(log.attachments) if name.startswith(OBSTRUCTIONS)]
    for name in listed:
        _compare_obstructions(check, log, name)
    for blocker in () if listed else site.blockers:
        told = f"fixed object {blocker.id!r} is in the log, but no obstruction file is"
        check.look(blocker.kind != "obstruction", told)
    for note in () if listed else filter(None, site.obstruction_notes):
        check.look(False, f"it has a note about obstructions, but no obstruction file: {note}")
    check.look(len(listed) <= 1, f"it carries several obstruction files: {', '.join(listed)}")
    if log.carried_out is not None:
        known |= {name for name in log.attachments if name.startswith(TRACKS)}
    for name in sorted(log.attachments.keys() - known - set(listed)):
        check.look(False, f"attached {name}: it is not a file that bimvox attaches to the log of this site")
    compare_held(check, log)
    return check


def config_in(log: PlanLog) -> SiteConfig | None:
    """Return the site file that a log carries; None if it carries none, or one that cannot be read."""
    with suppress(BimvoxError, UnicodeDecodeError):
        if (text := log.attachments.get(SITE_FILE)) is not None:
            return _config_of(log, text)
    return None


def only_as_cells(log: PlanLog) -> tuple[str, ...]:
    """Return the ids of the obstructions whose mesh or point files are not in the log, so that only cells are known."""
    found: set[str] = set()
    for name, data in log.attachments.items():
        if name.startswith(OBSTRUCTIONS) and name.rpartition(".")[2] in LISTED:
            with suppress(BimvoxError):
                found |= without_references(data, name)[1]
    return tuple(sorted(found))


def _config_of(log: PlanLog, text: bytes) -> SiteConfig:
    """Return the site file that a log carries, in the site's frame, with its machines and the programme."""
    config = parse_site_config(text.decode("utf-8-sig"), SITE_FILE, _machine_files(log), attached_programme(log))
    to_map = map_of_model(log.metadata.get(GEOREFERENCE, ""), log.plan.site.source)
    return on_site(config, log.plan.site.site_to_ifc, to_map)


def _machine_files(log: PlanLog) -> dict[str, bytes]:
    """Return the files of machines that a log carries, by the names that its site file gives them."""
    return {name.removeprefix(MACHINE): data for name, data in log.attachments.items() if name.startswith(MACHINE)}


def compare_config(check: Check, site: Site, config: SiteConfig, source: str) -> None:
    """Compare a site with its site file, and what the file leaves to be chosen with the choice for the site's parts.

    Raises:
        BimvoxError: If the file does not fit the site, or its crane is not consistent.
    """
    same_rules(check, site.rules, config.rules_in_force, source)
    if config.name is not None:
        same(check, "name", site.name, config.name, source)
    config = compare_pinned(check, site, config, source)
    building = building_of(site, config)
    given, config = config, completed(config, site, building)
    chosen = f"{source}, which leaves it to be chosen"
    cranes = cranes_on_ground(config, cranes_of(config), site.frame, site.natural_ground_m)
    same_cranes(check, site.cranes, cranes, source if given.crane is not None else chosen)
    same(check, "the set-ups of the crane", site.moving, moving_of(config, cranes), source)
    columns = site.shape[:2]
    for name, found, kinds in (("prohibited", site.prohibited, NO_HOOK), ("no_load", site.no_load, NO_LOAD)):
        wanted = columns_without(kinds, config.zone, site.frame, columns)
        check.look(equal(found, wanted), f"zones: the {name} columns are not those of {source}")
    heights = hook_heights(config.zone, site.frame, columns)
    check.look(equal_heights(site.hook_heights, heights), f"zones: the hook's limits are not those of {source}")
    areas = config.areas
    assert areas.construction is not None and areas.yard is not None
    construction = columns_centred_in([areas.construction], site.frame, columns)
    is_construction = site.labels[:, :, 0] == Label.CONSTRUCTION_AREA
    own = source if given.areas.construction else chosen
    check.look(bool((is_construction == construction).all()), f"areas.construction is not that of {own}")
    yard, access = ground_of(areas, site.frame, columns)
    own = source if given.areas.yard else chosen
    yard = level_yard(yard & ~construction, site.ground_vox)
    check.look(bool((site.yard == yard).all()), f"areas.yard is not that of {own}")
    check.look(equal(site.access, access), f"areas.access is not that of {source}")
    own = source if given.model.voxel_size_m else chosen
    same(check, "model.voxel_size_m", site.frame.voxel_size_m, config.model.voxel_size_m, own)
    yaw_rad = float(np.arctan2(site.site_to_ifc[1, 0], site.site_to_ifc[0, 0]))
    off_rad = abs((yaw_rad - config.model.yaw_rad + np.pi) % (2.0 * np.pi) - np.pi)
    check.look(off_rad <= _SAME, f"model.yaw_deg is {np.degrees(yaw_rad):g}; {source} has {config.model.yaw_deg:g}")
    height_m, wanted_m = float(site.site_to_ifc[2, 3]), config.model.ground_m
    assert wanted_m is not None
    own = source if given.model.ground_m is not None else chosen
    check.look(abs(height_m - wanted_m) <= 1e-6, f"model.ground_m is {height_m:g} in the log, {wanted_m:g} in {own}")
    # How low the terrain is, only the model tells.
    depth_m = -site.frame.origin_m[2] - site.frame.voxel_size_m if site.natural_ground_m is not None else 0.0
    frame, shape = site_extent(config, building, *cranes, least_depth_m=depth_m)
    _compare_extent(check, site, (frame, with_room_for_slings(config, frame, shape, site.components)), source)
    compare_parts(check, site, config, building, source)


def _compare_extent(check: Check, site: Site, wanted: tuple[GridFrame, IntVec], source: str) -> None:
    frame, shape = wanted
    off_m = np.abs(np.array(site.frame.origin_m) - np.array(frame.origin_m)).max()
    check.look(
        bool(off_m <= 1e-6) and site.shape == shape,
        f"the site is {site.shape} cells from {site.frame.origin_m} m in the log, "
        f"{shape} cells from {frame.origin_m} m in {source}",
    )


def _compare_obstructions(check: Check, log: PlanLog, name: str) -> None:
    """Compare the obstructions with those of an attached file."""
    site, data = log.plan.site, log.attachments[name]
    source = f"the attached {name}"
    scan_id, _, kind = name.removeprefix(OBSTRUCTIONS).rpartition(".")
    refers: frozenset[str] = frozenset()
    usual = attached_as(Path(f"{scan_id or OBSTRUCTIONS}.{kind}"))
    check.look(name == usual, f"attached {name}: bimvox calls such a file {usual}")
    with scratch_folder() as folder:
        try:
            if kind in LISTED:
                # The files that it refers to are not in the log, and a stranger's log must not name files to read.
                data, refers = without_references(data, name)
                kind = "json"
            if f".{kind}" not in KINDS:
                raise InputError("it is not of a kind that an obstruction file has")
            file = folder / f"{OBSTRUCTIONS}{kind}"  # not the name in the log, which may lead out of the folder
            file.write_bytes(data)
            of_file = load_obstructions(file, site, survey_in(log), scan_id=scan_id)
            wanted = with_obstructions(site, of_file, rasterise)
        except BimvoxError as error:
            check.look(False, f"{source} cannot be used: {error}")
            return
    found, given = ([one for one in each.blockers if one.kind == "obstruction"] for each in (site, wanted))
    by_id, may_be = {blocker.id: blocker for blocker in found}, set()
    for lost in sorted(refers):
        name_there, outside = id_on_site(lost, site), note_about(lost, Where.OUTSIDE, site.frame, site.shape)
        if name_there in by_id:
            given.append(by_id[name_there])  # of these the log has only the cells
            may_be.add(note_about(lost, Where.CLIPPED, site.frame, site.shape))
        elif outside in site.obstruction_notes:
            may_be.add(outside)
        else:
            check.look(False, f"fixed object {lost!r} is not in the log, but in {source}")
        if name_there != lost:
            may_be.add(renamed_note(lost, name_there))
    same_blockers(check, found, given, source)
    notes, own = (
        tuple(note for note in one.obstruction_notes if not (refers and (note in may_be or is_about_coordinates(note))))
        for one in (site, wanted)
    )
    same(check, "obstruction_notes", notes, own, source)


def _same_labels(check: Check, site: Site) -> None:
    """Compare the labels of the cells with the fixed objects, the yard and the construction area."""
    wrong = np.argwhere(site.labels != labels_of(site))
    at = tuple(wrong[0].tolist()) if len(wrong) else (0, 0, 0)
    there = ", ".join(blocker.id for blocker in site.blockers if (blocker.cells == at).all(axis=1).any())
    check.look(
        not len(wrong),
        f"{len(wrong)} cells are labelled as something else than is there, the first at {at}: "
        f"{Label(site.labels[at]).name}, where there is {there or 'nothing'}",
    )


def equal_heights(found: HookHeights | None, wanted: HookHeights | None) -> bool:
    """Return whether the limits of the hook's height are the same, or both are None."""
    if found is None or wanted is None:
        return found is wanted
    return np.array_equal(found.low_m, wanted.low_m) and np.array_equal(found.high_m, wanted.high_m)
