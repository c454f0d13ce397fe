"""The log of a small building, and faults written into it by a forger who recomputes all digests.

Each fault is a function from the good log to a faulty one. ``ALONE`` are faults that only one check can find.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from box_sites import box_cells, box_mesh, box_site, test_crane
from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.VoxelGrid_pb2 import VoxelGrid
from guided_sites import slab_between_beams
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk
from named_cranes import default_luffing_crane
from turning_sites import BESIDE_THE_PORTAL, turning_site

from bimvox.bim.building import TriangleMesh
from bimvox.crane.choose_rig import choose_rig
from bimvox.crane.gear import Gear, GearKind, Rig
from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import AxisLimits, SlowZone, TowerCrane, WorkingRange
from bimvox.grid.frame import Label
from bimvox.library.plan import digests_of
from bimvox.library.revise import carry_out
from bimvox.live.tracks import traffic_named
from bimvox.log import schema as topics
from bimvox.log.bundle import pack, unpack
from bimvox.log.plan_json import held_files
from bimvox.log.plan_log import PlanLog
from bimvox.log.segments import FIRST_PLAN, NOW_NS, first_plan_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.progress import SilentProgress
from bimvox.proof.carried_out import planned_axes, tally_of
from bimvox.records.lift import LOAD_IS_HELD, Epoch, LeftPath, Lift, ModelledClash, Status, not_lifted
from bimvox.records.motion import CarriedOut, LiftMotion, Phase, PhaseName, Trajectory
from bimvox.records.steps import Steps
from bimvox.revision.current_plan import HeldCranes, HeldHook
from bimvox.site.build import labels_of, with_digests
from bimvox.site.casting import FIELD_CASTING, CastTimes, Curing
from bimvox.site.component import Component, Lifting, StoredPose, shape_of
from bimvox.site.config.gear_file import gear_catalogue
from bimvox.site.config.rules import CuringConfig, RulesConfig, YardConfig
from bimvox.site.config.site_config import (
    AreasConfig,
    ComponentConfig,
    GridConfig,
    MeansConfig,
    ModelConfig,
    SequenceConfig,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.config.template import site_toml
from bimvox.site.crew_times import FIELD_TIMES
from bimvox.site.default_rules import TRUCK_M, YardRules
from bimvox.site.machine import crane_config
from bimvox.site.means import Means
from bimvox.site.parts import sail_area_m2
from bimvox.site.site import Blocker, HeadingRule, Rules, Site, SwingRule

Forge = Callable[[PlanLog], PlanLog]

PARTS = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
]
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 15.0, 3.0))


def good_log(swing: SwingRule = SwingRule.SHAPED) -> PlanLog:
    """Return the log of a portal of two columns, beam and slab, planned over a wall and timed."""
    crane = test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0)
    rules = Rules(swing=swing)
    return log_of(box_site(PARTS, structure=[WALL], crane=crane, shape=(40, 30, 24), rules=rules))


def log_with_a_clash() -> PlanLog:
    """Return the log of a beam drawn 40 mm into its column, and of a block that touches both legs of an angle."""
    parts = [
        ("beam", (1.0, 1.4, 2.9), (5.0, 1.6, 3.3)),
        ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.94)),
        ("block", (6.5, 1.0, 0.5), (7.5, 2.0, 1.5)),
        ("angle", (6.0, 1.0, 0.0), (7.5, 2.0, 2.0)),
    ]
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = box_site(parts, crane=crane, shape=(40, 30, 24))
    angle = site.components[3]
    outline = np.array([(6.0, 0.0), (7.5, 0.0), (7.5, 0.5), (6.5, 0.5), (6.5, 2.0), (6.0, 2.0)])
    corners = [(x, y, z) for y in (1.0, 2.0) for x, z in outline]
    front = [(0, n, n + 1) for n in range(1, 5)]
    back = [(6, n + 7, n + 6) for n in range(1, 5)]
    sides = [(n, n + 6, (n + 1) % 6) for n in range(6)] + [((n + 1) % 6, n + 6, (n + 1) % 6 + 6) for n in range(6)]
    mesh = TriangleMesh(np.array(corners), np.array([*front, *back, *sides], np.int32))
    cells = np.concatenate(
        [
            box_cells(site.frame, (6.0, 1.0, 0.0), (7.5, 2.0, 0.5)),
            box_cells(site.frame, (6.0, 1.0, 0.5), (6.5, 2.0, 2.0)),
        ]
    )
    shape, target = shape_of(cells)
    # Its legs weigh 1.5 x 0.5 and 0.5 x 1.5 to the metre.
    aside = ((0.75 * 0.75 + 0.75 * 0.25) / 1.5 / 0.5 - 1.5, -0.4999)
    angle = dataclasses.replace(
        angle,
        mesh=mesh,
        shape=shape,
        target_vox=target,
        hook_offset_vox=(1, 1, shape.size_vox[2]),
        hook_aside_vox=aside,
    )
    return log_of(dataclasses.replace(site, components=(*site.components[:3], angle)))


def log_of(site: Site) -> PlanLog:
    """Return the log of a site, planned by search and timed."""
    site = with_digests(site)
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    motions = time_plan(plan, preparation) if site.cranes else ()
    return with_files(PlanLog(plan=plan, motions=tuple(motions)), {"site.toml": site_file_of(site)})


def with_files(log: PlanLog, files: Mapping[str, bytes]) -> PlanLog:
    """Return a log with these attached files, and their digests in its metadata."""
    metadata = {key: value for key, value in log.metadata.items() if not key.startswith("sha256 ")}
    return dataclasses.replace(log, attachments=dict(files), metadata=metadata | digests_of(files))


def obstruction_file_of(site: Site) -> dict[str, bytes]:
    """Return the obstruction file that gives the obstructions of a site; none if it has none."""
    found = [one for one in site.blockers if one.kind == "obstruction"]
    listed = [{"id": one.id, "voxels": one.cells.tolist()} for one in found]
    document = json.dumps({"version": 1, "obstructions": listed}).encode()
    return {"obstructions.json": document} if found else {}


def site_file_of(site: Site, **changes: Any) -> bytes:
    """Return the site file that gives this site: rules, crane, zones, areas, extent and what it asks of parts."""
    rules = dataclasses.asdict(site.rules) | {"swing": site.rules.swing.value, "heading": site.rules.heading.value}
    rules |= dict.fromkeys(rules.pop("gives_way"))  # defaults are not written
    if rules["props"] is None:
        rules["props"] = {"planned": False}
    if rules["curing"] is None:
        rules["curing"] = dict.fromkeys(CuringConfig.model_fields, 0.0) | {"floors_wait": True}
    lying = rules.pop("yard")
    if lying is not None:
        edges = zip(("truck_length_m", "truck_width_m", "truck_height_m"), lying.pop("truck_m"), strict=True)
        lying |= dict(edges)
    search, size_m = rules.pop("order_search"), site.frame.voxel_size_m
    (x0, y0, _), (nx, ny, nz) = site.frame.origin_m, site.shape
    built = site.labels[:, :, 0] == Label.CONSTRUCTION_AREA
    nowhere = ((x0 - 9.0, y0 - 9.0), (x0 - 8.0, y0 - 9.0), (x0 - 8.0, y0 - 8.0))
    config = SiteConfig(
        name=site.name,
        model=ModelConfig(path=Path("boxes.ifc"), voxel_size_m=size_m, ground_m=float(site.site_to_ifc[2, 3])),
        means=MeansConfig(lift_from_kg=0.0),
        grid=GridConfig(low_m=(x0, y0), high_m=(x0 + nx * size_m, y0 + ny * size_m, (nz - 1) * size_m)),
        areas=AreasConfig(
            construction=next(iter(rows_of(site, built)), nowhere), yard=rows_of(site, site.yard) or (nowhere,)
        ),
        crane=crane_config(site.cranes[0] if site.cranes else None),
        component=tuple(filter(None, map(entry_of(site), site.components))),
        sequence=SequenceConfig(search=search, storeys=any(part.hints.rank is not None for part in site.components)),
        rules=RulesConfig(**rules),
        yard=None if lying is None else YardConfig(**lying),
        zone=tuple(
            ZoneConfig(polygon=one) for one in ([] if site.prohibited is None else rows_of(site, site.prohibited))
        ),
    )
    return site_toml(config.model_copy(update=changes)).encode()


def rows_of(site: Site, columns: np.ndarray) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Return rectangles that cover these columns of a site: one if they are a rectangle, otherwise one a column."""
    found = np.argwhere(columns)
    if not len(found):
        return ()
    low, high = found.min(axis=0), found.max(axis=0)
    whole = len(found) == np.prod(high - low + 1)
    boxes = [(low, high)] if whole else [(one, one) for one in found]
    corners = [[site.frame.corner_of((*n, 0))[:2].tolist() for n in (first, last + 1)] for first, last in boxes]
    return tuple(((x, y), (a, y), (a, b), (x, b)) for (x, y), (a, b) in corners)


def entry_of(site: Site) -> Callable[[Component], ComponentConfig | None]:
    """Return the table of a part in the site file; None if it needs none."""

    def entry(part: Component) -> ComponentConfig | None:
        start = part.start_vox and tuple((site.frame.corner_of(part.start_vox) + site.frame.voxel_size_m / 2).tolist())
        table = ComponentConfig(
            global_id=part.id,
            start=start,
            pose=part.stored_pose,
            turn=part.stored_turn,
            before=part.before,
            after=part.after,
            means=None if part.means is Means.CRANE else part.means.value,
        )
        return table if table != ComponentConfig(global_id=part.id) else None

    return entry


def index_of(log: PlanLog, name: str) -> int:
    return next(n for n, c in enumerate(log.plan.site.components) if c.id == name)


def lift_of(log: PlanLog, name: str):
    return next(lift for lift in log.plan.lifts if lift.component == index_of(log, name))


def with_site(log: PlanLog, **changes) -> PlanLog:
    """Return the log of a changed site; the forger also rewrites the labels and the attached files."""
    site = dataclasses.replace(log.plan.site, **changes)
    if "labels" not in changes:
        site = dataclasses.replace(site, labels=labels_of(site))
    site = with_digests(site)
    forged = without_a_new_file(log, site)
    try:
        files = {name: data for name, data in log.attachments.items() if not name.startswith("obstructions.")}
        return with_files(forged, {**files, "site.toml": site_file_of(site), **obstruction_file_of(site)})
    except ValueError:  # no site file can have such values
        return forged


def without_a_new_file(log: PlanLog, site: Site) -> PlanLog:
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))


def with_component(log: PlanLog, name: str, **changes) -> PlanLog:
    components = list(log.plan.site.components)
    at = index_of(log, name)
    components[at] = dataclasses.replace(components[at], **changes)
    return with_site(log, components=tuple(components))


def with_blocker(
    log: PlanLog, name: str, cells, kind: str = "obstruction", mesh: TriangleMesh | None = None
) -> PlanLog:
    cells = np.array(cells, np.int32).reshape(-1, 3)
    return with_site(log, blockers=(*log.plan.site.blockers, Blocker(name, kind, cells, mesh)))


def with_lift(log: PlanLog, name: str, **changes) -> PlanLog:
    old = lift_of(log, name)
    lifts = tuple(dataclasses.replace(lift, **changes) if lift is old else lift for lift in log.plan.lifts)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, lifts=lifts))


def with_motion(log: PlanLog, order: int, **changes) -> PlanLog:
    motions = tuple(dataclasses.replace(m, **changes) if m.order == order else m for m in log.motions)
    return dataclasses.replace(log, motions=motions)


def with_loaded(log: PlanLog, order: int, **changes) -> PlanLog:
    return with_motion(log, order, loaded=dataclasses.replace(log.motions[order].loaded, **changes))


def detour(log: PlanLog, name: str, at: int, *moves: tuple[int, int, int]) -> tuple[PlanLog, np.ndarray]:
    """Return a path that leaves a placement by unit moves and returns the same way, and where it leads."""
    path = lift_of(log, name).path_vox
    aside = path[at] + np.cumsum(np.array(moves, np.int32), axis=0)
    longer = np.concatenate([path[: at + 1], aside, aside[-2::-1], path[at:]]).astype(np.int32)
    return with_lift(log, name, path_vox=longer), aside[-1]


def hook_columns(log: PlanLog) -> tuple[set, set, set]:
    """Return the columns under the hook: on the planned paths, in the loaded motions, in the approaches."""
    site, planned, loaded, empty = log.plan.site, set(), set(), set()
    for lift in log.plan.lifts:
        offset = site.components[lift.component].hook_offset_vox
        planned |= {(x + offset[0], y + offset[1]) for x, y, _ in lift.path_vox.tolist()}
    for motion in log.motions:
        for part, into in ((motion.approach, empty), (motion.raising, loaded), (motion.loaded, loaded)):
            if part is not None:
                at_m = hook_of(site.cranes[0], part.slew_rad, part.radius_m, part.height_m)
                into |= {tuple(c[:2]) for c in site.frame.cell_of(at_m).tolist()}
    return planned, loaded, empty


def only_in(first: set, *others: set) -> tuple[int, int]:
    """Return the middle one of the columns in the first set that are not within a cell of another set."""
    near = {(x + i, y + j) for other in others for x, y in other for i in (-1, 0, 1) for j in (-1, 0, 1)}
    left = sorted(first - near) or sorted(first - set().union(*others))
    return left[len(left) // 2]


def top_cell(log: PlanLog, column: tuple[int, int]) -> tuple[int, int, int]:
    return (*column, log.plan.site.shape[2] - 1)


def a_step_removed(log: PlanLog) -> PlanLog:
    return with_lift(log, "left", path_vox=np.delete(lift_of(log, "left").path_vox, 3, axis=0))


def an_end_off_by_a_cell(log: PlanLog) -> PlanLog:
    return with_lift(log, "slab", path_vox=lift_of(log, "slab").path_vox[:-1])


def a_path_through_a_wall(log: PlanLog) -> PlanLog:
    # Aside and down where nothing else passes, into a kerb that is lower than the hook.
    spoiled, end = detour(log, "left", 1, *[(0, 1, 0)] * 6)
    own = log.plan.site.components[index_of(log, "left")].shape.cells
    return with_blocker(spoiled, "kerb", (own + end)[own[:, 2].argmin()])


def a_beam_pushed_into_its_columns(log: PlanLog) -> PlanLog:
    return detour(log, "beam", len(lift_of(log, "beam").path_vox) - 1, (0, 0, -1))[0]


def against_the_planners_wish(log: PlanLog) -> PlanLog:
    return with_component(log, "left", after=("slab",))


def outside_the_yard(log: PlanLog) -> PlanLog:
    yard = log.plan.site.yard.copy()
    place = lift_of(log, "beam").place
    yard[tuple((place.shape.cells + np.array(place.cell_vox))[:, :2].T)] = False
    return with_site(log, yard=yard)


def a_surface_beside_its_cells(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", mesh=box_mesh((1.0, 1.0, 3.4), (5.0, 2.6, 3.6)))


def a_building_in_the_air(log: PlanLog) -> PlanLog:
    # No ground, and something that supports only the slab.
    site = log.plan.site
    slab = site.components[index_of(log, "slab")]
    beside = slab.shape.cells + np.array(slab.target_vox)
    at = beside[np.lexsort((beside[:, 2], beside[:, 1], beside[:, 0]))[0]] - [0, 1, 0]
    afloat = with_site(log, blockers=tuple(b for b in site.blockers if b.kind != "ground"))
    low = site.frame.corner_of(at)
    return with_blocker(afloat, "hook", at, "structure", box_mesh(low + 0.1, low + 0.4))


def too_near_in_transit(log: PlanLog) -> PlanLog:
    return with_site(log, rules=dataclasses.replace(log.plan.site.rules, transit_clearance_m=2.0))


def with_clearance(log: PlanLog, **rules) -> PlanLog:
    """The honest log of the same site with a clearance of a metre in transit."""
    careful = with_site(log, rules=dataclasses.replace(log.plan.site.rules, transit_clearance_m=1.0, **rules))
    site = careful.plan.site
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return dataclasses.replace(careful, plan=plan, motions=tuple(time_plan(plan, preparation)))


def in_wind(log: PlanLog, speed_m_s: float = 5.0) -> PlanLog:
    """The honest log of the same site with a clearance of a metre in transit, in which every lift must be possible."""
    parts = tuple(dataclasses.replace(part, sail_area_m2=sail_area_m2(part.mesh)) for part in log.plan.site.components)
    return with_clearance(with_site(log, components=parts), wind_speed_m_s=speed_m_s)


def a_gust_called_weaker(log: PlanLog) -> PlanLog:
    """The log says of a load that it swings half as far in a gust as it does."""
    windy = in_wind(log)
    wind = windy.motions[1].wind
    return with_motion(windy, 1, wind=dataclasses.replace(wind, swing_m=0.5 * wind.swing_m))


def more_wind_than_its_sail_permits(log: PlanLog) -> PlanLog:
    windy = in_wind(log)
    return with_motion(windy, 1, wind=dataclasses.replace(windy.motions[1].wind, speed_m_s=40.0))


def less_wind_than_is_asked_for(log: PlanLog) -> PlanLog:
    windy = in_wind(log)
    return with_motion(windy, 1, wind=dataclasses.replace(windy.motions[1].wind, speed_m_s=4.9))


def no_wind_stated(log: PlanLog) -> PlanLog:
    return with_motion(in_wind(log), 1, wind=None)


def a_gust_beyond_the_clearance(log: PlanLog) -> PlanLog:
    """The load is in a gust that swings it further than the log says it keeps clear of the wall."""
    windy = in_wind(log)
    rules = dataclasses.replace(windy.plan.site.rules, transit_clearance_m=0.01)
    return with_site(windy, rules=rules)


def upended_too_near(log: PlanLog) -> PlanLog:
    """The columns lie half a metre apart, and the log says that they keep two metres while they are upended."""
    return with_site(log, rules=dataclasses.replace(log.plan.site.rules, upending_clearance_m=2.0))


def lowered_past_a_post(log: PlanLog) -> PlanLog:
    """The slab is lowered half a metre from a post, and the log says that it keeps a metre."""
    careful = with_clearance(with_blocker(log, "post", [(5, 5, z) for z in range(9, 14)], "obstruction"))
    return with_site(careful, rules=dataclasses.replace(careful.plan.site.rules, approach_clearance_m=1.0))


def a_path_that_dips_over_the_wall(log: PlanLog) -> PlanLog:
    careful = with_clearance(log)
    lift = lift_of(careful, "slab")
    path = lift.path_vox
    over = next(n for n in range(len(path)) if path[n, 0] <= 15)
    dip = np.array([path[over] - [0, 0, down] for down in (1, 2, 1, 0)], np.int32)
    return with_lift(careful, "slab", path_vox=np.concatenate([path[: over + 1], dip, path[over + 1 :]]))


def a_motion_lower_than_its_path(log: PlanLog) -> PlanLog:
    careful = with_clearance(log)
    preparation = prepare(careful.plan.site)
    low = plan_lifts(log.plan.site, preparation)
    motions = time_plan(low, preparation)
    return dataclasses.replace(careful, motions=tuple(motions))


def a_clearance_given_up(log: PlanLog) -> PlanLog:
    # As if the site file left it to its default; it gives a metre.
    given = with_clearance(log)
    lifts = tuple(dataclasses.replace(lift, clearance_m=0.0) for lift in log.plan.lifts)
    rules = dataclasses.replace(given.plan.site.rules, gives_way=("transit_clearance_m",))
    forged = with_site(dataclasses.replace(given, plan=dataclasses.replace(given.plan, lifts=lifts)), rules=rules)
    return dataclasses.replace(forged, motions=log.motions, attachments=given.attachments)


def a_clearance_given_up_in_silence(log: PlanLog) -> PlanLog:
    given = with_clearance(log)
    return dataclasses.replace(given, plan=dataclasses.replace(given.plan, lifts=log.plan.lifts), motions=log.motions)


def a_gap_on_the_clock(log: PlanLog) -> PlanLog:
    phases = log.motions[2].phases
    gap = dataclasses.replace(phases[1], start_ns=phases[1].start_ns + 1)
    return with_motion(log, 2, phases=(phases[0], gap, *phases[2:]))


def a_slower_crane(log: PlanLog) -> PlanLog:
    crane = log.plan.site.cranes[0]
    return with_site(
        log,
        cranes=(dataclasses.replace(crane, slewing=dataclasses.replace(crane.slewing, rate=crane.slewing.rate * 0.5)),),
    )


def a_lower_jib(log: PlanLog) -> PlanLog:
    highest = max(float(m.loaded.height_m.max()) for m in log.motions)
    return with_site(log, cranes=(dataclasses.replace(log.plan.site.cranes[0], jib_height_m=highest - 0.01),))


def a_whole_turn_between_lifts(log: PlanLog) -> PlanLog:
    for part in ("approach", "raising", "loaded"):
        old = getattr(log.motions[2], part)
        log = with_motion(log, 2, **{part: dataclasses.replace(old, slew_rad=old.slew_rad + 2.0 * np.pi)})
    return log


def samples_left_out(log: PlanLog) -> PlanLog:
    loaded = log.motions[0].loaded
    way = np.abs(np.diff(loaded.slew_rad)) * loaded.radius_m[1:]
    first = int(np.argmax(way)) - 3
    kept = np.setdiff1d(np.arange(len(loaded.time_ns)), [first + n for n in (1, 2, 4, 5)])
    where = np.searchsorted(kept, loaded.corner)
    thinned = Trajectory(
        loaded.time_ns[kept], loaded.slew_rad[kept], loaded.radius_m[kept], loaded.height_m[kept], where, loaded.bound_s
    )
    return with_motion(log, 0, loaded=thinned)


def an_axis_sample_edited(log: PlanLog) -> PlanLog:
    radius_m = log.motions[1].loaded.radius_m.copy()
    radius_m[len(radius_m) // 2] += 0.3
    return with_loaded(log, 1, radius_m=radius_m)


def a_wrong_mass(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", mass_kg=50.0 * log.plan.site.components[index_of(log, "slab")].mass_kg)


def a_load_carried_too_low(log: PlanLog) -> PlanLog:
    loaded = log.motions[0].loaded
    return with_loaded(log, 0, height_m=np.minimum(loaded.height_m, loaded.height_m[0] + 0.5))


def a_cable_in_the_motions_way(log: PlanLog) -> PlanLog:
    planned, loaded, empty = hook_columns(log)
    return with_blocker(log, "cable", top_cell(log, only_in(loaded, planned, empty)))


def a_bird_in_the_empty_hooks_way(log: PlanLog) -> PlanLog:
    planned, loaded, empty = hook_columns(log)
    return with_blocker(log, "bird", top_cell(log, only_in(empty, planned, loaded)))


def a_motion_over_a_zone(log: PlanLog) -> PlanLog:
    planned, loaded, empty = hook_columns(log)
    zone = np.zeros(log.plan.site.shape[:2], bool)
    zone[only_in(loaded, planned, empty)] = True
    return with_site(log, prohibited=zone)


def something_where_only_the_motion_goes(log: PlanLog) -> PlanLog:
    """Return the first cell that a load's corner passes through and no planned placement, rope or hook touches."""
    site = log.plan.site
    planned = np.zeros(site.shape, bool)
    for x, y in hook_columns(log)[2]:
        planned[x - 1 : x + 2, y - 1 : y + 2] = True
    for lift in log.plan.lifts:
        component = site.components[lift.component]
        for cell in lift.path_vox:
            planned[tuple((component.shape.cells + cell).T)] = True
            x, y, z = cell + np.array(component.hook_offset_vox)
            planned[x, y, z:] = True
        planned[tuple((lift.place.shape.cells + np.array(lift.place.cell_vox)).T)] = True
    motion = max(log.motions, key=lambda m: len(m.loaded.time_ns))
    component = site.components[motion.component]
    size_m = site.frame.voxel_size_m
    for n in range(len(motion.loaded.time_ns) // 2, len(motion.loaded.time_ns)):
        loaded = motion.loaded
        hook_m = hook_of(site.cranes[0], loaded.slew_rad[n], loaded.radius_m[n], loaded.height_m[n])
        low = hook_m - [0, 0, site.cranes[0].sling_m] - size_m * (np.array([0.5, 0.5, 0.0]) + component.hook_line_vox)
        high = low + size_m * np.array(component.shape.size_vox)
        for corner in np.ndindex(2, 2, 2):
            at = np.where(np.array(corner) == 0, low + 0.1 * size_m, high - 0.1 * size_m)
            cell = tuple(int(c) for c in site.frame.cell_of(at))
            if not planned[cell]:
                return with_blocker(log, "twig", cell)
    raise AssertionError("the motion goes nowhere but along the path")


def two_lifts_swapped(log: PlanLog) -> PlanLog:
    beam, left = lift_of(log, "beam"), lift_of(log, "left")
    swapped = with_lift(with_lift(log, "beam", order=left.order), "left", order=beam.order)
    lifts = tuple(sorted(swapped.plan.lifts, key=lambda lift: lift.order))
    return dataclasses.replace(swapped, plan=dataclasses.replace(swapped.plan, lifts=lifts))


def a_file_exchanged(log: PlanLog) -> PlanLog:
    return dataclasses.replace(log, metadata={**log.metadata, "sha256 site.toml": "0" * 64})


def a_file_without_a_digest(log: PlanLog) -> PlanLog:
    return dataclasses.replace(log, metadata={})


def a_file_with_an_empty_digest(log: PlanLog) -> PlanLog:
    return dataclasses.replace(log, metadata={**log.metadata, "sha256 site.toml": ""})


def an_obstruction_called_like_a_part(log: PlanLog) -> PlanLog:
    return with_blocker(log, "beam", [(39, 29, 1)])


def a_structure_without_a_surface(log: PlanLog) -> PlanLog:
    """A cell that carries what stands on it, and that no triangles show."""
    return with_blocker(log, "plinth", [(39, 29, 1)], "structure")


def a_cell_shifted(log: PlanLog) -> PlanLog:
    part = log.plan.site.components[index_of(log, "beam")]
    return with_component(log, "beam", target_vox=tuple(np.add(part.target_vox, (1, 0, 0)).tolist()))


def a_box_on_the_path(log: PlanLog) -> PlanLog:
    path = lift_of(log, "beam").path_vox
    middle = log.plan.site.frame.corner_of(path[len(path) // 2])
    return with_blocker(log, "crate", box_cells(log.plan.site.frame, middle, middle + 0.5))


def aside_of_motions(log: PlanLog) -> tuple[PlanLog, tuple[int, int]]:
    """Return a path of ``left`` with a detour where no motion takes the hook, and the column under its hook there."""
    _, loaded, empty = hook_columns(log)
    near = {(x + i, y + j) for x, y in loaded | empty for i in (-1, 0, 1) for j in (-1, 0, 1)}
    offset = np.array(log.plan.site.components[index_of(log, "left")].hook_offset_vox)
    for count in range(1, 15):
        for step in ((1, 0, 0), (-1, 0, 0), (0, 1, 0)):
            spoiled, end = detour(log, "left", 1, *[step] * count)
            column = tuple(int(n) for n in (end + offset)[:2])
            if column not in near and (end >= 0).all() and (end + 6 < log.plan.site.shape).all():
                return spoiled, column
    raise AssertionError("the motions go everywhere")


def a_rope_through_a_roof(log: PlanLog) -> PlanLog:
    spoiled, column = aside_of_motions(log)
    return with_blocker(spoiled, "roof", top_cell(log, column))


def a_path_over_a_zone(log: PlanLog) -> PlanLog:
    spoiled, column = aside_of_motions(log)
    zone = np.zeros(log.plan.site.shape[:2], bool)
    zone[column] = True
    return with_site(spoiled, prohibited=zone)


def outside_the_boundary(log: PlanLog) -> PlanLog:
    # Its reference cell stays inside the site, its other cells do not.
    last = log.plan.site.shape[1] - 1 - int(lift_of(log, "slab").path_vox[1][1])
    return detour(log, "slab", 1, *[(0, 1, 0)] * last)[0]


def a_part_rotated(log: PlanLog) -> PlanLog:
    place = lift_of(log, "beam").place
    return with_lift(log, "beam", place=dataclasses.replace(place, pose=StoredPose.LYING_X))


def a_part_turned(log: PlanLog) -> PlanLog:
    return with_lift(log, "beam", place=dataclasses.replace(lift_of(log, "beam").place, turn=1))


def not_upright_as_the_file_says(log: PlanLog) -> PlanLog:
    return with_component(log, "left", stored_pose=StoredPose.AS_BUILT, erected=False)


def not_turned_as_the_file_says(log: PlanLog) -> PlanLog:
    return with_component(log, "beam", stored_turn=1)


def a_truck_overloaded(log: PlanLog) -> PlanLog:
    return with_site(log, rules=dataclasses.replace(log.plan.site.rules, truckload_kg=500.0))


def too_near_for_the_slinger(log: PlanLog) -> PlanLog:
    return with_rules(log, yard=YardRules(gap_m=4.0, truck_m=TRUCK_M))


def a_stack_on_the_ground_side_by_side(log: PlanLog) -> PlanLog:
    """Two parts are said to be in one stack, but both lie on the ground."""
    stacked = with_rules(log, yard=YardRules(gap_m=0.0, truck_m=TRUCK_M))
    for name in ("slab", "beam"):
        stacked = with_lift(stacked, name, place=dataclasses.replace(lift_of(stacked, name).place, stack=1))
    return stacked


def a_beam_in_a_rack(log: PlanLog) -> PlanLog:
    racked = with_rules(log, yard=YardRules(gap_m=0.0, rack_parts=1, rack_depth=0.0, truck_m=TRUCK_M))
    return with_lift(racked, "beam", place=dataclasses.replace(lift_of(racked, "beam").place, rack=1))


def lifts_not_numbered(log: PlanLog) -> PlanLog:
    last = log.plan.lifts[-1]
    spoiled = with_lift(log, log.plan.site.components[last.component].id, order=last.order + 1)
    motions = (*log.motions[:-1], dataclasses.replace(log.motions[-1], order=last.order + 1))
    return dataclasses.replace(spoiled, motions=motions)


def a_weaker_crane(log: PlanLog) -> PlanLog:
    crane = log.plan.site.cranes[0]
    chart = dataclasses.replace(crane.chart, capacity_kg=tuple(0.05 * c for c in crane.chart.capacity_kg))
    return with_site(log, cranes=(dataclasses.replace(crane, chart=chart),))


def less_of_the_capacity_permitted(log: PlanLog) -> PlanLog:
    """The rules permit hardly any of the capacity; the lifts use more."""
    return with_rules(log, highest_utilisation=0.05)


def a_corner_that_is_none(log: PlanLog) -> PlanLog:
    loaded = log.motions[1].loaded
    moving = int(np.argmax(np.abs(np.diff(loaded.slew_rad))))
    return with_loaded(log, 1, corner=np.union1d(loaded.corner, [moving]).astype(loaded.corner.dtype))


def moves_that_are_not_shaped(log: PlanLog) -> PlanLog:
    loose = with_site(log, rules=dataclasses.replace(log.plan.site.rules, swing=SwingRule.OFF))
    site = loose.plan.site
    motions = time_plan(loose.plan, prepare(site))
    return with_site(dataclasses.replace(loose, motions=tuple(motions)), rules=log.plan.site.rules)


# Invalid values, by what the refusal must say.


def unshaped_but_stopped_for_a_moment(log: PlanLog) -> PlanLog:
    """While each load is lowered, and each hook arrives, a stop of a nanosecond is said to take its swing away."""

    def phases(motion: LiftMotion) -> Iterator[Phase]:
        for phase in motion.phases:
            if phase.name in (PhaseName.LOWER, PhaseName.APPROACH):
                at_ns = phase.start_ns + int(0.95 * (phase.end_ns - phase.start_ns))
                yield Phase(phase.name, phase.start_ns, at_ns)
                yield Phase(PhaseName.STOP, at_ns, at_ns + 1)
                yield Phase(phase.name, at_ns + 1, phase.end_ns)
            else:
                yield phase

    swinging = moves_that_are_not_shaped(log)
    motions = tuple(dataclasses.replace(motion, phases=tuple(phases(motion))) for motion in swinging.motions)
    return dataclasses.replace(swinging, motions=motions)


def with_rules(log: PlanLog, **changes) -> PlanLog:
    return with_site(log, rules=dataclasses.replace(log.plan.site.rules, **changes))


def with_crane(log: PlanLog, **changes) -> PlanLog:
    return with_site(log, cranes=(dataclasses.replace(log.plan.site.cranes[0], **changes), *log.plan.site.cranes[1:]))


def faster_by(log: PlanLog, factor: float) -> PlanLog:
    crane = log.plan.site.cranes[0]
    axes = {name: getattr(crane, name) for name in ("slewing", "trolley", "hoist")}
    return with_crane(log, **{name: AxisLimits(*(factor * n for n in astuple(a))) for name, a in axes.items()})


def a_vertex_that_is_nan(log: PlanLog) -> PlanLog:
    mesh = log.plan.site.components[index_of(log, "beam")].mesh
    vertices_m = mesh.vertices_m.copy()
    vertices_m[2, 1] = np.nan
    return with_component(log, "beam", mesh=TriangleMesh(vertices_m, mesh.faces))


def two_parts_of_one_id(log: PlanLog) -> PlanLog:
    components = list(log.plan.site.components)
    components[1] = dataclasses.replace(components[1], id=components[0].id)
    return with_site(log, components=tuple(components))


def luffing(log: PlanLog, **changes: Any) -> PlanLog:
    """Return the log with a luffing crane instead of its own; the motions stay."""
    crane = default_luffing_crane("luffing-40")
    assert crane.luffing is not None
    return with_crane_of(log, dataclasses.replace(crane, luffing=dataclasses.replace(crane.luffing, **changes)))


def with_crane_of(log: PlanLog, crane: TowerCrane) -> PlanLog:
    return with_site(log, cranes=(crane,))


def a_phase_that_never_ends(log: PlanLog) -> PlanLog:
    phases = log.motions[1].phases
    return with_motion(log, 1, phases=(*phases[:-1], dataclasses.replace(phases[-1], end_ns=2**62)))


def a_bound_of_its_raising(log: PlanLog) -> PlanLog:
    return with_motion(log, 1, raising=dataclasses.replace(log.motions[1].raising, bound_s=1e12))


def a_ground_of_dust(log: PlanLog) -> PlanLog:
    """The ground keeps its cells, but near it triangles decide: a speck in each cell."""
    ground, frame = log.plan.site.blockers[0], log.plan.site.frame
    speck = np.array([[0.1] * 3, [0.2] * 3, [0.1, 0.2, 0.1]])
    specks_m = frame.corner_of(ground.cells)[:, None] + frame.voxel_size_m * speck[None]
    mesh = TriangleMesh(specks_m.reshape(-1, 3), np.arange(3 * len(ground.cells), dtype=np.int32).reshape(-1, 3))
    return with_site(log, blockers=(dataclasses.replace(ground, mesh=mesh), *log.plan.site.blockers[1:]))


_FASTEST = AxisLimits(float("inf"), float("inf"), float("inf"))

NONSENSE: dict[str, tuple[Forge, str]] = {
    "a way of what the crane does not lift": (
        lambda log: with_lift(
            with_component(unplanned(log, "slab", "so"), "slab", means=Means.IN_SITU, means_reason="so"),
            "slab",
            status=Status.IN_SITU,
            clearance_m=1.0,
        ),
        "(slab): the crane does not lift it, but it has the values of a way",
    ),
    "last moves before the first": (
        lambda log: with_lift(log, "beam", contact_moves=10**6),
        "(beam): contact_moves is 1,000,000, but its path has",
    ),
    "a phase that never ends": (a_phase_that_never_ends, "its phase release ends at 4611686018 s on the site"),
    "a bound of its raising": (a_bound_of_its_raising, "(right): bound_s of its raising motion is 1e+12"),
    "a hook beyond all grids": (
        lambda log: with_component(log, "beam", hook_offset_vox=(0, 0, 2**40)),
        "(beam): hook_offset_vox: 1.09951e+12 is not a coordinate in range",
    ),
    "luffing without limits": (lambda log: luffing(log, limits=_FASTEST), "luffing.limits.rate is inf"),
    "winch without limits": (lambda log: luffing(log, winch=_FASTEST), "luffing.winch.rate is inf"),
    "a jib of no width": (lambda log: luffing(log, width_m=0.0), "luffing.width_m is 0"),
    "a jib of nan": (lambda log: luffing(log, width_m=float("nan")), "luffing.width_m is nan"),
    "no counterweight": (lambda log: luffing(log, tail_radius_m=0.0), "luffing.tail_radius_m is 0"),
    "a counterweight of no width": (lambda log: luffing(log, tail_width_m=-2.0), "luffing.tail_width_m is -2"),
    "a counterweight in the sky": (lambda log: luffing(log, tail_low_m=1e5), "luffing.tail_low_m is 100000"),
    "a pivot nowhere": (lambda log: luffing(log, pivot_height_m=float("nan")), "luffing.pivot_height_m is nan"),
    "slow zone of nan": (
        lambda log: with_crane(log, slow_zones=(SlowZone(((0.0, 0.0), (9.0, 0.0), (9.0, float("nan"))), 0.5),)),
        "slow zone, polygon",
    ),
    "a slow zone that is a line": (
        lambda log: with_crane(log, slow_zones=(SlowZone(((0.0, 0.0), (9.0, 9.0)), 0.5),)),
        "slow zone, polygon: it has fewer than three corners",
    ),
    "a slow zone that is fast": (
        lambda log: with_crane(log, slow_zones=(SlowZone(((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)), float("nan")),)),
        "slow zone, share is nan",
    ),
    "limiter of nan": (
        lambda log: with_crane(log, working_range=WorkingRange(highest_hook_m=float("nan"))),
        "working_range.highest_hook_m: nan is not a coordinate in range",
    ),
    "tolerance of a metre": (lambda log: with_rules(log, contact_tolerance_m=1.0), "contact_tolerance_m is 1;"),
    "negative tolerance": (lambda log: with_rules(log, contact_tolerance_m=-0.01), "contact_tolerance_m is -0.01"),
    "tolerance nan": (lambda log: with_rules(log, contact_tolerance_m=float("nan")), "contact_tolerance_m is nan"),
    "negative gap": (lambda log: with_rules(log, support_gap_m=-5.0), "support_gap_m is -5"),
    "gap of a storey": (lambda log: with_rules(log, support_gap_m=5.0), "support_gap_m is 5"),
    "sampling": (lambda log: with_rules(log, sample_period_s=1e6), "sample_period_s is 1e+06"),
    "clearance inf": (lambda log: with_rules(log, transit_clearance_m=float("-inf")), "transit_clearance_m is -inf"),
    "mass": (lambda log: with_component(log, "beam", mass_kg=-1e9), "(beam): mass_kg is -1e+09"),
    "no mass": (lambda log: with_component(log, "beam", mass_kg=float("nan")), "(beam): mass_kg is nan"),
    "sail": (lambda log: with_component(log, "beam", sail_area_m2=-1.0), "(beam): sail_area_m2 is -1"),
    "rates": (lambda log: faster_by(log, 1000.0), "slewing.rate is 80"),
    "rate nan": (lambda log: faster_by(log, float("nan")), "slewing.rate is nan"),
    "rigging": (lambda log: with_crane(log, rigging_mass_kg=-1e6), "rigging_mass_kg is -1e"),
    "sling": (lambda log: with_crane(log, sling_m=float("nan")), "sling_m is nan"),
    "vertex": (a_vertex_that_is_nan, "(beam): mesh.vertices_m"),
    "twins": (two_parts_of_one_id, "the id occurs twice"),
    "one GlobalId": (
        lambda log: with_component(log, "beam", global_id="slab"),
        "(beam): its GlobalId 'slab' is not that of its id 'beam'",
    ),
    "unheld ghost": (lambda log: with_plan(log, unheld=("ghost",)), "unheld: 'ghost' is not a part of the site"),
    "before a ghost": (
        lambda log: with_component(log, "beam", before=("ghost",)),
        "(beam): before names 'ghost', which is not a part of the site",
    ),
    "after a wall": (lambda log: with_component(log, "slab", after=("wall",)), "(slab): after names 'wall', which"),
    "ghostly kind": (
        lambda log: with_blocker(log, "spook", [(39, 29, 1)], "ghost"),
        "fixed object 'spook': there is no kind 'ghost'",
    ),
    "planned with a reason": (
        lambda log: with_lift(log, "beam", reason="it is too heavy"),
        "lift 3 (beam): it is planned, yet it says why it is not possible",
    ),
    "planned and blocked": (lambda log: with_lift(log, "beam", blocked_by=("wall",)), "lift 3 (beam): it is planned"),
    "blocked by a ghost": (
        lambda log: unplanned(log, "slab", "it is blocked at its place", ("ghost",)),
        "lift 4 (slab): it is blocked by 'ghost', which is not on the site",
    ),
    "a ground of dust": (a_ground_of_dust, "fixed object 'ground': it has a surface; only structures have"),
    "a clearance of its own": (
        lambda log: with_lift(log, "beam", clearance_m=0.5),
        "lift 3 (beam): it keeps 0.5 m of transit_clearance_m, which does not give way on this site",
    ),
    "a clearance of its rope": (
        lambda log: with_lift(log, "beam", rope_clearance_m=0.5),
        "lift 3 (beam): it keeps 0.5 m of rope_clearance_m, which does not give way on this site",
    ),
    "found by nothing": (
        lambda log: with_lift(log, "beam", method=None),
        "lift 3 (beam): it is planned, and its path was found by nothing",
    ),
}
"""Logs that must be refused for a value before anything is proven, each with what the refusal says."""


# Sites that differ from the files that the log carries: the digests are recomputed, the files are kept.


def keeping_its_files(forge: Forge) -> Forge:
    """Return the same fault by a forger who leaves the attached files unchanged."""
    return lambda log: with_files(forge(log), log.attachments)


def with_obstructions_file(log: PlanLog) -> PlanLog:
    """Return a good log with a truck and a crate next to the building, and the obstruction file."""
    boxes = {"truck": ((16.0, 12.0, 0.0), (18.0, 14.0, 1.5)), "crate": ((14.0, 13.0, 0.0), (14.5, 13.5, 0.5))}
    listed = [{"id": name, "box": {"min": low, "max": high}} for name, (low, high) in boxes.items()]
    document = json.dumps({"version": 1, "unit": "m", "obstructions": listed}).encode()
    for name, (low, high) in boxes.items():
        log = with_blocker(log, name, box_cells(log.plan.site.frame, low, high))
    return with_files(log, {**log.attachments, "obstructions.json": document})


def with_a_file_of_a_mesh(log: PlanLog) -> PlanLog:
    """Return a log whose obstruction file lists a truck by its mesh, which is not in the log, and no truck."""
    document = b'{"version": 1, "unit": "m", "obstructions": [{"id": "truck", "mesh": "truck.stl"}]}'
    return with_files(log, {**log.attachments, "obstructions.json": document})


def noted_of_a_mesh(note: str) -> Forge:
    """Return a forgery by which a truck of a mesh file, which is on the site, has a note."""

    def forge(log: PlanLog) -> PlanLog:
        site = with_a_file_of_a_mesh(with_blocker(log, "truck", [(36, 26, 1)])).plan.site
        site = with_digests(dataclasses.replace(site, obstruction_notes=(note,)))
        return with_a_file_of_a_mesh(without_a_new_file(log, site))

    return forge


def with_obstruction_files(*names: str) -> Forge:
    """Return a forgery that attaches obstruction files without obstructions."""
    texts = {"json": b'{"version": 1, "obstructions": []}', "toml": b"version = 1\nobstructions = []\n"}
    files = {name: texts[name.rpartition(".")[2]] for name in names}
    return lambda log: with_files(log, {**log.attachments, **files})


def without_blocker(log: PlanLog, name: str) -> PlanLog:
    return with_site(log, blockers=tuple(blocker for blocker in log.plan.site.blockers if blocker.id != name))


def a_smaller_truck(log: PlanLog) -> PlanLog:
    blockers = [dataclasses.replace(b, cells=b.cells[:3]) if b.id == "truck" else b for b in log.plan.site.blockers]
    return with_site(log, blockers=tuple(blockers))


def a_stronger_crane(log: PlanLog) -> PlanLog:
    chart = log.plan.site.cranes[0].chart
    return with_crane(log, chart=dataclasses.replace(chart, capacity_kg=tuple(100.0 * c for c in chart.capacity_kg)))


def no_crane_at_all(log: PlanLog) -> PlanLog:
    return dataclasses.replace(with_site(log, cranes=()), motions=())


NOT_ITS_FILES: dict[str, tuple[Forge, str]] = {
    "stronger": (keeping_its_files(a_stronger_crane), "crane 'test': chart"),
    "faster": (keeping_its_files(lambda log: faster_by(log, 5.0)), "crane 'test': slewing"),
    "no crane": (
        keeping_its_files(no_crane_at_all),
        "the list of cranes is [] in the log, ['test'] in the attached site.toml",
    ),
    "swing off": (keeping_its_files(lambda log: with_rules(log, swing=SwingRule.OFF)), "rules.swing is off"),
    "permitted utilisation": (
        keeping_its_files(lambda log: with_rules(log, highest_utilisation=0.9)),
        "rules.highest_utilisation is 0.9 in the log, 1.0 in the attached site.toml",
    ),
    "tolerance": (
        keeping_its_files(lambda log: with_rules(log, contact_tolerance_m=0.09)),
        "contact_tolerance_m is 0.09",
    ),
    "times of a class": (
        keeping_its_files(lambda log: with_rules(log, times=dataclasses.replace(FIELD_TIMES, column=FIELD_TIMES.slab))),
        "rules.times.column.brace_s is 180.0 in the log, 720.0 in the attached site.toml",
    ),
    "wait of a class": (
        keeping_its_files(
            lambda log: with_rules(log, casting=dataclasses.replace(FIELD_CASTING, beam=CastTimes(11.0, 1.0)))
        ),
        "rules.casting.beam.wait_h is 1.0 in the log, 168.0 in the attached site.toml",
    ),
    "people who cast": (
        keeping_its_files(lambda log: with_rules(log, casting=dataclasses.replace(FIELD_CASTING, people=80.0))),
        "rules.casting.people is 80.0 in the log, 8.0 in the attached site.toml",
    ),
    "name": (
        keeping_its_files(lambda log: with_site(log, name="the palace")),
        "name is the palace in the log, boxes in the attached site.toml",
    ),
    "a note about obstructions": (
        lambda log: with_site(log, obstruction_notes=("truck: outside the site",)),
        "it has a note about obstructions, but no obstruction file: truck: outside the site",
    ),
    "a note behind an empty one": (
        lambda log: with_site(log, obstruction_notes=("", "the city has checked the ground")),
        "it has a note about obstructions, but no obstruction file: the city has checked the ground",
    ),
    "a note about what a mesh file holds": (
        noted_of_a_mesh("obstruction 'truck' has been checked by the city"),
        "obstruction_notes is (\"obstruction 'truck' has been checked by the city\",) in the log",
    ),
    "outside, and on the site": (
        noted_of_a_mesh("obstruction 'truck' lies outside the site, which is from (0, 0, -0.5) to (20, 15, 11.5) m"),
        "obstruction_notes is (\"obstruction 'truck' lies outside",
    ),
    "two obstruction files": (
        with_obstruction_files("obstructions.json", "obstructions.toml"),
        "it carries several obstruction files: obstructions.json, obstructions.toml",
    ),
    "an obstruction file with words in its name": (
        with_obstruction_files("obstructions.approved by the city.json"),
        "attached obstructions.approved by the city.json: bimvox calls such a file obstructions.json",
    ),
    "cranes that hold nothing": (
        lambda log: with_files(
            log, {**log.attachments, **held_files(HeldCranes((), (HeldHook(0, (0.0, 9.0, 9.0), ()),)))}
        ),
        "attached held_cranes.zip: it holds no load",
    ),
    "no file": (lambda log: with_files(log, {}), "it carries no site.toml"),
    "no ground": (lambda log: without_blocker(log, "ground"), "fixed object 'ground' is not in the log"),
    "truck of a mesh dropped": (with_a_file_of_a_mesh, "fixed object 'truck' is not in the log"),
    "truck dropped": (
        lambda log: keeping_its_files(lambda one: without_blocker(one, "truck"))(with_obstructions_file(log)),
        "fixed object 'truck' is not in the log",
    ),
    "truck shrunk": (
        lambda log: keeping_its_files(a_smaller_truck)(with_obstructions_file(log)),
        "fixed object 'truck' has other cells",
    ),
    "wall of nobody": (
        lambda log: keeping_its_files(lambda one: with_blocker(one, "fence", [(39, 29, 1)]))(log),
        "fixed object 'fence' is in the log, but no obstruction file is",
    ),
    "approval": (
        lambda log: with_files(log, {**log.attachments, "approval.txt": b"the city approves"}),
        "attached approval.txt: it is not a file that bimvox attaches",
    ),
    "machine of nobody": (
        lambda log: with_files(log, {**log.attachments, "machine.giant.toml": b"name = 'giant'"}),
        "attached machine.giant.toml: it is not a file that bimvox attaches",
    ),
}
"""Forgeries that the attached files reveal, each with what the refusal says."""


def with_phase_of(log: PlanLog, name: PhaseName, length_ns: int) -> PlanLog:
    """Return the lifts with another length of the named phase, and everything after it shifted in time."""
    motions: list[LiftMotion] = []
    clock_ns = 0
    for motion in log.motions:
        phases: list[Phase] = []
        at_ns, late_ns = clock_ns, {}
        for phase in motion.phases:
            span_ns = length_ns if phase.name is name else phase.end_ns - phase.start_ns
            late_ns[phase.start_ns - motion.start_ns] = at_ns - clock_ns - (phase.start_ns - motion.start_ns)
            phases.append(Phase(phase.name, at_ns, at_ns + span_ns))
            at_ns += span_ns
        moved = {
            part: dataclasses.replace(old, time_ns=old.time_ns + late_ns[int(old.time_ns[0])])
            for part in ("approach", "raising", "loaded")
            if (old := getattr(motion, part)) is not None
        }
        motions.append(dataclasses.replace(motion, phases=tuple(phases), start_ns=clock_ns, end_ns=at_ns, **moved))
        clock_ns = at_ns
    return dataclasses.replace(log, motions=tuple(motions))


def with_carrying(log: PlanLog, *names: PhaseName) -> PlanLog:
    """Return every lift with other names for the phases in which its load is carried; the first one is longest.

    If there are fewer names than phases, the first lasts as long as the ones left out.
    """
    motions = []
    for motion in log.motions:
        carrying = [p for p in motion.phases if p.name in (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER)]
        first = carrying[: len(carrying) - len(names) + 1]
        spans = [(first[0].start_ns, first[-1].end_ns), *((p.start_ns, p.end_ns) for p in carrying[len(first) :])]
        named = [Phase(name, *span) for name, span in zip(names, spans, strict=True)]
        at = motion.phases.index(carrying[0])
        phases = (*motion.phases[:at], *named, *motion.phases[at + len(carrying) :])
        motions.append(dataclasses.replace(motion, phases=phases))
    return dataclasses.replace(log, motions=tuple(motions))


def lowered_from_the_first_moment_of_the_traverse(log: PlanLog) -> PlanLog:
    motions = []
    for motion in log.motions:
        phases = list(motion.phases)
        at = next(n for n, phase in enumerate(phases) if phase.name is PhaseName.LOWER)
        start_ns = phases[at - 1].start_ns + 1
        phases[at - 1] = dataclasses.replace(phases[at - 1], end_ns=start_ns)
        phases[at] = dataclasses.replace(phases[at], start_ns=start_ns)
        motions.append(dataclasses.replace(motion, phases=tuple(phases)))
    return dataclasses.replace(log, motions=tuple(motions))


OTHER_PHASES: dict[str, tuple[Forge, str]] = {
    "traverse called hoist": (
        lambda log: with_carrying(log, PhaseName.HOIST, PhaseName.LOWER),
        r"\): it slews or trolleys in its phase hoist, which begins at \d+",
    ),
    "all called traverse": (
        lambda log: with_carrying(log, PhaseName.TRAVERSE),
        r"\): it is lowered for .* s before it is set, in its phase traverse",
    ),
    "all called lower": (
        lambda log: with_carrying(log, PhaseName.LOWER),
        r"\): it is hoisted in its phase lower, which begins at \d+",
    ),
    "lower at once": (
        lowered_from_the_first_moment_of_the_traverse,
        r"\): it is hoisted in its phase lower, which begins at \d+",
    ),
}
"""Logs whose phases are called otherwise than what the crane does in them, each with what ``timeline`` says."""


def no_time_to_hook_on(log: PlanLog) -> PlanLog:
    return with_phase_of(log, PhaseName.HOOK_ON, 1000)


def no_time_for_tag_lines(log: PlanLog) -> PlanLog:
    return with_phase_of(log, PhaseName.HOOK_ON, 120_000_000_000)


def tag_lines_left_on(log: PlanLog) -> PlanLog:
    return with_phase_of(log, PhaseName.RELEASE, 60_000_000_000)


def no_time_to_set(log: PlanLog) -> PlanLog:
    return with_phase_of(log, PhaseName.SET, 1000)


def every_part_set_like_a_slab(log: PlanLog) -> PlanLog:
    return with_phase_of(log, PhaseName.SET, 180 * 10**9)


def no_time_to_release(log: PlanLog) -> PlanLog:
    return with_phase_of(log, PhaseName.RELEASE, 1000)


def no_trial_lift(log: PlanLog) -> PlanLog:
    raising = max(int(m.raising.time_ns[-1] - m.raising.time_ns[0]) for m in log.motions)
    return with_phase_of(log, PhaseName.RAISE, raising + 1000)


def with_plan(log: PlanLog, **changes) -> PlanLog:
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, **changes))


def carried_out_until(log: PlanLog, *history: Epoch) -> PlanLog:
    """Return a log that a watch carries out while obstructions change, as its metadata says too."""
    watched = {FIRST_PLAN: first_plan_of(log), NOW_NS: str(history[-1].until_ns)}
    return dataclasses.replace(
        with_plan(log, history=history), revision=log.revision + 1, metadata={**log.metadata, **watched}
    )


def nothing_carried(log: PlanLog) -> PlanLog:
    return log.extract([])


def nothing_planned(log: PlanLog) -> PlanLog:
    lifts = [
        dataclasses.replace(
            lift, status=Status.INFEASIBLE, method=None, path_vox=None, shortest_moves=None, reason="so"
        )
        for lift in log.plan.lifts
    ]
    return dataclasses.replace(with_plan(log, lifts=tuple(lifts)), motions=())


def a_path_left_by_a_stop_that_never_was(log: PlanLog) -> PlanLog:
    """The path is one cell, the target; a stop that no motion contains excuses its start."""
    lift = lift_of(log, "beam")
    left = LeftPath(lift.path_vox, lift.contact_moves, log.motions[lift.order].start_ns + 1)
    return with_lift(log, "beam", path_vox=lift.path_vox[-1:], shortest_moves=0, contact_moves=0, left=(left,))


def the_same_with_an_epoch(log: PlanLog) -> PlanLog:
    forged = a_path_left_by_a_stop_that_never_was(log)
    until_ns = lift_of(forged, "beam").left[0].until_ns
    return carried_out_until(forged, Epoch(until_ns, ()))


def without_a_crane(log: PlanLog) -> PlanLog:
    return dataclasses.replace(with_site(log, cranes=()), motions=())


def a_stop_without_a_crane(log: PlanLog) -> PlanLog:
    return without_a_crane(a_path_left_by_a_stop_that_never_was(log))


def one_cell_without_a_crane(log: PlanLog) -> PlanLog:
    path = lift_of(log, "beam").path_vox
    return without_a_crane(with_lift(log, "beam", path_vox=path[-1:], shortest_moves=0, contact_moves=0))


def an_epoch_that_never_ends(log: PlanLog) -> PlanLog:
    """The obstruction is in the path; the plan claims that it came after everything was set."""
    until_ns = log.motions[-1].end_ns + 1
    return carried_out_until(a_box_on_the_path(log), Epoch(until_ns, ()))


def a_structure_with_another_surface(log: PlanLog) -> PlanLog:
    """The wall's cells stay, but near it triangles decide, and these are elsewhere."""
    mesh = box_mesh((8.0, 0.0, 0.0), (8.5, 1.0, 0.5))
    blockers = [dataclasses.replace(b, mesh=mesh) if b.id == "wall" else b for b in log.plan.site.blockers]
    return with_site(log, blockers=tuple(blockers))


def thin_columns(low: Sequence[float], high: Sequence[float]) -> TriangleMesh:
    """Return columns of 1 mm on the edges of a box, and a sheet across it: its outline, but not its body."""
    edges = [(x, y) for x in (low[0], high[0] - 0.001) for y in (low[1], high[1] - 0.001)]
    columns = [box_mesh((x, y, low[2]), (x + 0.001, y + 0.001, high[2])) for x, y in edges]
    corners = np.array([low, (high[0], low[1], low[2]), (high[0], high[1], low[2])])
    return TriangleMesh.joined([*columns, TriangleMesh(corners, np.array([[0, 1, 2]], np.int32))])


def a_part_of_thin_columns(log: PlanLog) -> PlanLog:
    """The slab's cells stay, but there is almost nothing in them that could touch a neighbour."""
    return with_component(log, "slab", mesh=thin_columns((1.0, 1.0, 3.4), (5.0, 2.0, 3.6)))


def a_structure_of_thin_columns(log: PlanLog) -> PlanLog:
    mesh = thin_columns(*WALL[1:])
    blockers = [dataclasses.replace(b, mesh=mesh) if b.id == "wall" else b for b in log.plan.site.blockers]
    return with_site(log, blockers=tuple(blockers))


def a_slab_of_a_milligram(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", mass_kg=1e-6)


def masses_a_thousandth(log: PlanLog) -> PlanLog:
    parts = [dataclasses.replace(part, mass_kg=part.mass_kg / 1000.0) for part in log.plan.site.components]
    return with_site(log, components=tuple(parts))


def a_slab_of_a_milligram_with_a_hole(log: PlanLog) -> PlanLog:
    mesh = log.plan.site.components[index_of(log, "slab")].mesh
    open_mesh = TriangleMesh(mesh.vertices_m, np.delete(mesh.faces, 5, axis=0))
    return with_component(log, "slab", mass_kg=1e-6, mesh=open_mesh)


def a_slab_heavier_than_any_metal(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", mass_kg=0.8 * 26_000.0)


def with_lifting(log: PlanLog, *points_m: tuple[float, float, float], rise_vox: int = 0) -> PlanLog:
    return with_component(log, "slab", lifting=Lifting(points_m, "anchors", rise_vox))


def lifted_from_where_it_is_not(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", lifting=Lifting(((40.0, 1.5, 3.6),), "centre_of_mass", 0))


def hung_beside_its_centre(log: PlanLog) -> PlanLog:
    """The slingers would find the point 0.3 m aside."""
    part = log.plan.site.components[index_of(log, "slab")]
    cell = np.add(part.target_vox, part.hook_line_vox) + np.array([0.5, 0.5, 0.0])
    x, y, z = log.plan.site.frame.corner_of(cell).tolist()
    return with_component(log, "slab", lifting=Lifting(((x + 0.3, y, z),)))


def with_gear(log: PlanLog, change: Callable[[Rig], Rig] = lambda rig: rig) -> PlanLog:
    """Give every part gear of one leg, and the slab's a change."""
    site, parts = log.plan.site, []
    gear, sling_m = Gear(gear_catalogue()), site.cranes[0].sling_m
    for part in site.components:
        cell = np.add(part.target_vox, part.hook_line_vox) + np.array([0.5, 0.5, 0.0])
        x, y, z = site.frame.corner_of(cell).tolist()
        rig = choose_rig(
            part.mass_kg, [(0.0, 0.0, 0.0)], usual_m=sling_m, step_m=site.frame.voxel_size_m, most_angle_rad=0.5,
            attached_by=GearKind.SHACKLE, gear=gear,
        )  # fmt: skip
        rig = change(rig) if part.id == "slab" else rig
        parts.append(dataclasses.replace(part, lifting=Lifting(((x, y, z),), "assumed", 0, rig)))
    return with_site(log, components=tuple(parts))


def with_pieces(log: PlanLog, first: dict[str, Any], last: dict[str, Any] | None = None, **changes: Any) -> PlanLog:
    """Change the upper and the last piece of the slab's gear."""

    def change(rig: Rig) -> Rig:
        one, *others, end = rig.parts
        end = dataclasses.replace(end, **(last or {}))
        parts = (dataclasses.replace(one, **first), *others, end)
        return dataclasses.replace(rig, parts=parts, **changes)

    return with_gear(log, change)


def gear_of_no_mass(log: PlanLog) -> PlanLog:
    return with_pieces(log, {}, {"mass_kg": float("nan")})


def a_sling_that_is_too_weak(log: PlanLog) -> PlanLog:
    return with_pieces(log, {"rated_kg": 1500.0, "wll_kg": 1500.0})


def a_sling_said_to_carry_more_than_its_tag(log: PlanLog) -> PlanLog:
    return with_pieces(log, {"rated_kg": 1500.0, "wll_kg": 2000.0})


def a_shackle_said_to_carry_half(log: PlanLog) -> PlanLog:
    return with_pieces(log, {}, {"load_kg": 900.0})


def gear_lighter_than_its_pieces(log: PlanLog) -> PlanLog:
    return with_pieces(log, {}, mass_kg=1.0)


def gear_lower_than_the_hook(log: PlanLog) -> PlanLog:
    return with_pieces(log, {}, height_m=0.5)


def a_sling_too_short(log: PlanLog) -> PlanLog:
    return with_pieces(log, {"made_m": 0.5})


def more_legs_than_points(log: PlanLog) -> PlanLog:
    return with_pieces(log, {"legs": 2, "carrying": 2})


def lifted_without_gear(log: PlanLog) -> PlanLog:
    log = with_gear(log)
    part = log.plan.site.components[index_of(log, "slab")]
    return with_component(log, "slab", lifting=dataclasses.replace(part.lifting, source="centre_of_mass", rig=None))


def lifted_although_no_gear_serves(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", lifting=Lifting((), "centre_of_mass", 0, None, "no shackle carries it"))


def hung_on_anything(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", lifting=Lifting((), "magnets"))


def a_delivery_that_never_comes(log: PlanLog) -> PlanLog:
    def later(lift: Lift) -> Lift:
        return dataclasses.replace(lift, place=lift.place and dataclasses.replace(lift.place, delivery=1))

    return with_plan(log, lifts=tuple(map(later, log.plan.lifts)))


def lifted_far_from_the_part(log: PlanLog) -> PlanLog:
    return with_lifting(log, (40.0, 1.5, 3.6), (3.0, 1.5, 3.6), rise_vox=124)


def slings_that_are_too_flat(log: PlanLog) -> PlanLog:
    return with_lifting(log, (1.2, 1.5, 3.6), (4.8, 1.5, 3.6))


def slings_longer_than_needed(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", lifting=Lifting((), "centre_of_mass", 2))


def a_hook_aside(log: PlanLog) -> PlanLog:
    """The load would hang at its end, nearer to the crane."""
    part = log.plan.site.components[index_of(log, "beam")]
    return with_component(log, "beam", hook_offset_vox=(0, 0, part.shape.size_vox[2]))


def a_hook_5_mm_aside(log: PlanLog) -> PlanLog:
    part = log.plan.site.components[index_of(log, "beam")]
    x, y = part.hook_aside_vox
    return with_component(log, "beam", hook_aside_vox=(x + 0.005 / log.plan.site.frame.voxel_size_m, y))


def a_hook_in_another_cell(log: PlanLog) -> PlanLog:
    return with_component(log, "slab", hook_aside_vox=(float("nan"), 0.6))


def a_mirrored_model(log: PlanLog) -> PlanLog:
    return with_site(log, site_to_ifc=np.diag([1.0, -1.0, 1.0, 1.0]))


def a_scaled_model(log: PlanLog) -> PlanLog:
    return with_site(log, site_to_ifc=np.diag([2.0, 2.0, 2.0, 1.0]))


def a_model_on_its_head(log: PlanLog) -> PlanLog:
    return with_site(log, site_to_ifc=np.diag([1.0, -1.0, -1.0, 1.0]))


def a_bound_that_the_motion_beats(log: PlanLog) -> PlanLog:
    return with_loaded(log, 1, bound_s=1e6)


def a_clash_called_shallower(log: PlanLog) -> PlanLog:
    (clash,) = log.plan.clashes
    return with_plan(log, clashes=(dataclasses.replace(clash, depth_m=0.001),))


def a_clash_listed_twice(log: PlanLog) -> PlanLog:
    (clash,) = log.plan.clashes
    back = dataclasses.replace(clash, first=clash.second, second=clash.first)
    return with_plan(log, clashes=(clash, back))


def a_clash_with_nobody(log: PlanLog) -> PlanLog:
    return with_plan(log, clashes=(*log.plan.clashes, ModelledClash("nobody", "beam", 2.0, None)))


def an_epoch_to_the_last_moment(log: PlanLog) -> PlanLog:
    return carried_out_until(a_box_on_the_path(log), Epoch(log.motions[-1].end_ns, ()))


def an_obstruction_called_like_the_wall(log: PlanLog) -> PlanLog:
    cells = box_cells(log.plan.site.frame, (9.0, 0.0, 0.0), (9.5, 1.0, 1.0))
    return carried_out_until(log, Epoch(log.motions[-1].start_ns, (Blocker("wall", "obstruction", cells),)))


def with_labels(log: PlanLog, label: Label, low: tuple[int, int, int], high: tuple[int, int, int]) -> PlanLog:
    labels = log.plan.site.labels.copy()
    labels[tuple(slice(*ends) for ends in zip(low, high, strict=True))] = label
    return with_site(log, labels=labels)


def a_wall_out_of_the_labels(log: PlanLog) -> PlanLog:
    return with_labels(log, Label.AIR, (0, 0, 1), log.plan.site.shape)


def a_wall_in_the_labels_alone(log: PlanLog) -> PlanLog:
    """Nothing is in the way there, but a viewer shows a wall."""
    return with_labels(log, Label.STRUCTURE, (30, 20, 1), (31, 25, 5))


def no_ground_in_the_labels(log: PlanLog) -> PlanLog:
    return with_labels(log, Label.AIR, (0, 0, 0), (*log.plan.site.shape[:2], 1))


def an_epoch_before_the_last_lift(log: PlanLog) -> PlanLog:
    """True as far as the log shows: only the last lift came after the obstruction, and is clear of it."""
    path = lift_of(log, "left").path_vox
    middle = log.plan.site.frame.corner_of(path[2])
    crated = with_blocker(log, "crate", box_cells(log.plan.site.frame, middle, middle + 0.5))
    return carried_out_until(crated, Epoch(log.motions[-1].start_ns, ()))


def at_time(motion: LiftMotion, start_ns: int) -> LiftMotion:
    """Return a motion at another time; its samples count from its start."""
    late_ns = start_ns - motion.start_ns
    phases = tuple(Phase(one.name, one.start_ns + late_ns, one.end_ns + late_ns) for one in motion.phases)
    return dataclasses.replace(motion, phases=phases, start_ns=start_ns, end_ns=motion.end_ns + late_ns)


def the_last_lift_alone(start_ns: int | None = None) -> Forge:
    """Return the forgery of an extract with the last lift, which begins at another time."""

    def forge(log: PlanLog) -> PlanLog:
        alone = log.extract([log.motions[-1].order])
        (motion,) = alone.motions
        return alone if start_ns is None else dataclasses.replace(alone, motions=(at_time(motion, start_ns),))

    return forge


def a_pause_at_a_change(log: PlanLog) -> PlanLog:
    """The obstructions change after the third lift, and nothing moves until an hour later."""
    last = log.motions[-1]
    motions = (*log.motions[:-1], at_time(last, last.start_ns + 3600 * 10**9))
    return carried_out_until(dataclasses.replace(log, motions=motions), Epoch(last.start_ns + 1, ()))


def an_epoch_after_an_infeasible_end(until_ns: int | None = None) -> Forge:
    """Return the forgery of a log whose last lift is infeasible: the crate came when the others were done."""

    def forge(log: PlanLog) -> PlanLog:
        shorter = called_infeasible(log, "slab", "it is blocked at its place", ("wall",))
        ends_ns = shorter.motions[-1].end_ns
        return carried_out_until(a_box_on_the_path(shorter), Epoch(until_ns or ends_ns + 1, ()))

    return forge


def an_epoch_while_a_load_is_held(log: PlanLog) -> PlanLog:
    """The crate came later than the last motion: a load is said to hang on the hook meanwhile."""
    held = called_infeasible(log, "slab", f"{LOAD_IS_HELD}on the hook (stopped): nothing is free")
    return carried_out_until(a_box_on_the_path(held), Epoch(held.motions[-1].end_ns + 1, ()))


# What a viewer shows, changed after the plan was written: by topic, a function from bytes of a message to others.


def changed(kind: Any, change: Callable[[Any], None]) -> Callable[[bytes], bytes]:
    def spoil(data: bytes) -> bytes:
        message = kind.FromString(data)
        change(message)
        return bytes(message.SerializeToString(deterministic=True))

    return spoil


def _moved_frames(message: Any) -> None:
    for transform in message.transforms:
        transform.translation.x += 25.0


def _fast_joints(message: Any) -> None:
    for joint in message.joints:
        joint.velocity = 1e9


def _other_cubes(message: Any) -> None:
    for entity in message.entities:
        for cube in entity.cubes:
            cube.pose.position.z += 30.0


MESSAGES: dict[str, tuple[str, Callable[[bytes], bytes]]] = {
    "frames": (topics.TF, changed(FrameTransforms, _moved_frames)),
    "velocities": (topics.JOINTS, changed(JointStates, _fast_joints)),
    "scene": (topics.SCENE, changed(SceneUpdate, _other_cubes)),
    "garbage scene": (topics.SCENE, lambda data: b"garbage" + data[:5]),
    "voxels": (topics.VOXELS, changed(VoxelGrid, lambda m: setattr(m, "data", bytes(len(m.data))))),
    "log": (topics.LOG, changed(Log, lambda m: setattr(m, "message", "all is well"))),
    "remark": (topics.LOG, lambda data: data.replace(b"minor remark", b"major praise")),
    "tilt": (topics.LOAD, changed(PoseInFrame, lambda m: setattr(m, "frame_id", "elsewhere"))),
    "event": (topics.EVENTS, changed(Event, lambda m: m.metadata.add(key="name", value="other"))),
}
"""Messages that show something other than what is proven; no other check examines them."""
ATTACHED: dict[str, Callable[[bytes], bytes]] = {
    topics.URDF_FILE: lambda data: data.replace(b"jib", b"jab"),
    topics.CHART_FILE: lambda data: data.replace(b"20000.0", b"99000.0"),
    topics.REMARKS_FILE: lambda data: b"[]",
    topics.PLAN_FILE: lambda data: data.replace(b'"sling_m": 1.0', b'"sling_m": 9.0'),
}


# What other readers are told: records of the file, rewritten with checksums that fit. Messages stay as they are.

Record = tuple[int, bytes]


def _in_archive(change: Callable[[dict[str, bytes]], dict[str, bytes]]) -> Callable[[bytes], bytes]:
    return lambda data: pack(change(unpack(data)))


SAID_TWICE: dict[str, tuple[str, Callable[[bytes], bytes], str]] = {
    "status": (
        topics.PLAN_FILE,
        lambda data: data.replace(b'"status"', b'"status": "infeasible", "status"', 1),
        "attached plan.json is not what the plan gives: key 'status' occurs twice in the table of 'left'",
    ),
    "chart": (
        topics.CHART_FILE,
        lambda data: data.replace(b"{", b'{"crane": "giant", ', 1),
        "attached load_chart.json is not what the plan gives: key 'crane' occurs twice",
    ),
    "mass": (
        topics.SITE_FILE,
        _in_archive(lambda m: m | {"site.json": m["site.json"].replace(b'"mass_kg":', b'"mass_kg":1,"mass_kg":', 1)}),
        "attached site.bimvox.zip: its 'site.json' is not what bimvox writes for its site",
    ),
    "approval": (
        topics.SITE_FILE,
        _in_archive(lambda m: m | {"approval.txt": b"the city approves"}),
        "attached site.bimvox.zip: its 'approval.txt' is not what bimvox writes for its site",
    ),
    "archive before": (
        topics.SITE_FILE,
        lambda data: pack({"site.json": b"{}"}) + data,
        "attached site.bimvox.zip: it has bytes that bimvox does not write; other readers may show another site",
    ),
    "bytes after": (
        topics.SITE_FILE,
        lambda data: data + b"PK",
        "attached site.bimvox.zip: it has bytes that bimvox does not write; other readers may show another site",
    ),
}
"""Attached files that this reader and another one may read differently, and what the refusal says."""

_MAGIC = b"\x89MCAP0\r\n"


def records_of(data: bytes) -> list[Record]:
    """Return every record of an MCAP file: its kind, and its content."""
    at, found = len(_MAGIC), []
    while at < len(data) - len(_MAGIC):
        kind, length = struct.unpack_from("<BQ", data, at)
        at += 9
        found.append((kind, data[at : at + length]))
        at += length
    return found


def file_of(records: Sequence[Record], summary: tuple[int, int] | None = None, *, checked: bool = True) -> bytes:
    """Return an MCAP file of these records; the footer points at the summary, or says that it is elsewhere.

    Without ``checked``, the data have no checksum.
    """
    body, start, offsets = bytearray(_MAGIC), 0, 0
    for kind, content in records:
        if kind == Opcode.SUMMARY_OFFSET and not offsets:
            offsets = len(body)
        if kind == Opcode.FOOTER:
            start, offsets = (start, offsets) if summary is None else summary
            body += struct.pack("<BQQQ", kind, 20, start, offsets)
            body += struct.pack("<I", zlib.crc32(body[start:]) if start else 0)
            continue
        if kind == Opcode.DATA_END:
            content = struct.pack("<I", zlib.crc32(body) if checked else 0)
        body += struct.pack("<BQ", kind, len(content)) + content
        if kind == Opcode.DATA_END:
            start = len(body)
    return bytes(body) + _MAGIC


def _with(data: bytes, kind: int, change: Callable[[bytes], bytes]) -> bytes:
    """Return a file with the records of a kind changed."""
    return file_of([(one, change(content) if one == kind else content) for one, content in records_of(data)])


def _other_media_types(content: bytes) -> bytes:
    content = content[:-4].replace(b"application/json", b"application/jsox")
    return content + struct.pack("<I", zlib.crc32(content))


def _in_chunks(change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Return a change of what all chunks hold; it must keep the length, so that the indices still fit."""

    def spoil(content: bytes) -> bytes:
        chunk = Chunk.read(ReadDataStream(BytesIO(content)))
        inner = change(zstandard.decompress(chunk.data))
        head = struct.pack("<QQQI", *struct.unpack_from("<QQ", content), len(inner), zlib.crc32(inner))
        return head + struct.pack("<I", 0) + struct.pack("<Q", len(inner)) + inner

    return spoil


def _other_field_names(data: bytes) -> bytes:
    """Viewers would show the trolley's rate under another name."""

    def rename(content: bytes) -> bytes:
        return content.replace(b"trolley_rate_m_s", b"telfer_rate__m_s")

    return file_of(
        [
            (kind, _in_chunks(rename)(content) if kind == Opcode.CHUNK else rename(content))
            for kind, content in records_of(data)
            if kind not in (Opcode.CHUNK_INDEX, Opcode.SUMMARY_OFFSET)
        ]
    )


def _published_later(data: bytes) -> bytes:
    def late(inner: bytes) -> bytes:
        out, at = bytearray(inner), 0
        while at < len(inner):
            kind, length = struct.unpack_from("<BQ", inner, at)
            if kind == Opcode.MESSAGE:
                out[at + 9 + 14 : at + 9 + 22] = struct.pack("<Q", 10**15)
            at += 9 + length
        return bytes(out)

    return _with(data, Opcode.CHUNK, _in_chunks(late))


def _numbered_from_7(data: bytes) -> bytes:
    def late(inner: bytes) -> bytes:
        out, at = bytearray(inner), 0
        while at < len(inner):
            kind, length = struct.unpack_from("<BQ", inner, at)
            if kind == Opcode.MESSAGE:
                channel, number = struct.unpack_from("<HI", inner, at + 9)
                struct.pack_into("<HI", out, at + 9, channel, number + 7 * (channel == 1))
            at += 9 + length
        return bytes(out)

    return _with(data, Opcode.CHUNK, _in_chunks(late))


OTHER_READERS: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "no checksum": (
        lambda data: file_of(records_of(data), checked=False),
        "its data have no checksum, or another one",
    ),
    "numbers of messages": (_numbered_from_7, "/tf: its messages are not numbered 0, 1, 2 ..."),
    "another writer": (
        lambda data: _with(data, Opcode.HEADER, lambda content: content.replace(b"bimvox", b"mivbox")),
        "its header names another writer",
    ),
    "no summary": (lambda data: file_of(records_of(data), (0, 0)), "its footer does not point at its summary"),
    "offsets nowhere": (lambda data: file_of(records_of(data), (0, 777)), "its footer does not point at its summary"),
    "summary at the header": (lambda data: file_of(records_of(data), (8, 777)), "its footer does not point at"),
    "statistics": (
        lambda data: _with(data, Opcode.STATISTICS, lambda content: struct.pack("<Q", 7) + content[8:]),
        "its summary has another statistics than the file",
    ),
    "chunks at another time": (
        lambda data: _with(data, Opcode.CHUNK_INDEX, lambda content: struct.pack("<QQ", 0, 1) + content[16:]),
        "its summary has another chunk index than the file",
    ),
    "a chunk left out": (
        lambda data: file_of([r for r in records_of(data) if r[0] != Opcode.CHUNK_INDEX]),
        "its summary has another chunk index than the file",
    ),
    "messages left out": (
        lambda data: _with(data, Opcode.MESSAGE_INDEX, lambda content: content[:2] + struct.pack("<I", 0)),
        "a chunk's messages are not those of its index",
    ),
    "no messages in the index": (
        lambda data: file_of([r for r in records_of(data) if r[0] != Opcode.MESSAGE_INDEX]),
        "a chunk's messages are not all in its index",
    ),
    "an attachment elsewhere": (
        lambda data: _with(data, Opcode.ATTACHMENT_INDEX, lambda content: struct.pack("<Q", 8) + content[8:]),
        "its summary has another attachment index than the file",
    ),
    "a media type": (
        lambda data: _with(data, Opcode.ATTACHMENT, _other_media_types),
        "the attachment 'remarks.json' has another media type or time than bimvox's",
    ),
    "published later": (_published_later, "a message is published at another time than it is logged"),
    "names of fields": (_other_field_names, "/crane/command: its messages have another schema than bimvox's"),
}
"""Files that other readers would understand otherwise, each with what the refusal says."""


def touching_called_a_clash(log: PlanLog) -> PlanLog:
    clash = ModelledClash("slab", "beam", 1e-9, (0.0, 0.0, 1e-9))
    return with_plan(log, clashes=(*log.plan.clashes, clash))


def touching_called_interlocked(log: PlanLog) -> PlanLog:
    return with_plan(log, clashes=(*log.plan.clashes, ModelledClash("slab", "beam", 2.0, None)))


def a_clash_without_its_way_out(log: PlanLog) -> PlanLog:
    """The overlap is there, but the log says that nothing parts the two, so that any depth would be excused."""
    (clash,) = log.plan.clashes
    return with_plan(log, clashes=(dataclasses.replace(clash, depth_m=2.0, way_out_m=None),))


def touching_in_a_corner_called_a_clash(log: PlanLog) -> PlanLog:
    """The two only touch, although their boxes overlap by much."""
    return with_plan(log, clashes=(*log.plan.clashes, ModelledClash("block", "angle", 0.001, (0.001, 0.0, 0.0))))


def touching_in_a_corner_called_interlocked(log: PlanLog) -> PlanLog:
    return with_plan(log, clashes=(*log.plan.clashes, ModelledClash("block", "angle", 2.0, None)))


def a_clash_called_deeper(log: PlanLog) -> PlanLog:
    return with_plan(log, clashes=(*log.plan.clashes, ModelledClash("slab", "beam", 0.5, (0.0, 0.0, 0.5))))


def beams_on_a_column_that_is_never_set(log: PlanLog) -> PlanLog:
    """The column is infeasible; an invented clash of column and beam excuses setting the beam."""
    spoiled = with_lift(
        log, "left", status=Status.INFEASIBLE, method=None, path_vox=None, shortest_moves=None, reason="so"
    )
    clash = ModelledClash("beam", "left", 1e-9, (0.0, 0.0, 1e-9))
    order = lift_of(log, "left").order
    motions = tuple(motion for motion in log.motions if motion.order != order)
    return dataclasses.replace(with_plan(spoiled, clashes=(clash,)), motions=motions)


def a_column_set_by_nobody(log: PlanLog) -> PlanLog:
    """The column is infeasible, and called set by other means although the rules of the site forbid that."""
    order = lift_of(log, "left").order
    spoiled = with_rules(unplanned(log, "left", "so"), by_other_means=False)
    spoiled = with_lift(spoiled, "left", by_other_means=True)
    return dataclasses.replace(spoiled, motions=tuple(m for m in log.motions if m.order != order))


def a_beam_lifted_and_set_by_other_means(log: PlanLog) -> PlanLog:
    return with_lift(log, "beam", by_other_means=True)


def a_beam_called_cast_in_place(log: PlanLog) -> PlanLog:
    """A beam that the crane could lift is left out of the proof as cast in place."""
    spoiled = with_component(unplanned(log, "beam", "so"), "beam", means=Means.IN_SITU, means_reason="so")
    return with_files(with_lift(spoiled, "beam", status=Status.IN_SITU), log.attachments)


def a_column_by_other_means(log: PlanLog) -> PlanLog:
    """No fault: the column is too heavy, and stands when it is its turn."""
    return with_lift(
        unplanned(log, "left", "governing radius 12.0 m, at its place: 9000 kg"), "left", by_other_means=True
    )


def retimed(log: PlanLog) -> PlanLog:
    """Return a log with the motions of its plan."""
    site = log.plan.site
    return dataclasses.replace(log, motions=time_plan(log.plan, prepare(site)))


def one_cell_by_other_means(log: PlanLog) -> PlanLog:
    """Nobody lifts the column, and it is in nobody's way: it has only one cell."""
    part = log.plan.site.components[index_of(log, "left")]
    shape, target = shape_of(part.shape.cells[:1] + np.array(part.target_vox))
    return with_component(retimed(a_column_by_other_means(log)), "left", shape=shape, target_vox=target)


def a_sheet_by_other_means(log: PlanLog) -> PlanLog:
    """The column has its cells, but nothing that could touch a neighbour."""
    mesh = box_mesh((1.0, 1.4, 0.0), (1.01, 1.41, 2.98))
    return with_component(retimed(a_column_by_other_means(log)), "left", mesh=mesh)


def cells_that_do_not_fit_and_say_so(log: PlanLog) -> PlanLog:
    """The reason that the planner gives if the proof refuses the cells of a part."""
    return with_lift(one_cell_by_other_means(log), "left", reason="its lift could not be proven: shapes: left: so")


def cast_in_place(log: PlanLog, name: str) -> PlanLog:
    """No fault: a part is cast in place when it is its turn."""
    why = {"means": Means.IN_SITU, "means_reason": "the site file says so"}
    part = dataclasses.replace(log.plan.site.components[index_of(log, name)], **why)
    lift, order = lift_of(log, name), lift_of(log, name).order
    lifts = tuple(not_lifted(part, order) if one is lift else one for one in log.plan.lifts)
    return retimed(with_plan(with_component(log, name, **why), lifts=lifts))


def one_cell_cast_in_place(log: PlanLog) -> PlanLog:
    part = log.plan.site.components[index_of(log, "left")]
    shape, target = shape_of(part.shape.cells[:1] + np.array(part.target_vox))
    return with_component(cast_in_place(log, "left"), "left", shape=shape, target_vox=target)


def a_sheet_cast_in_place(log: PlanLog) -> PlanLog:
    mesh = box_mesh((1.0, 1.4, 0.0), (1.01, 1.41, 2.98))
    return with_component(cast_in_place(log, "left"), "left", mesh=mesh)


def a_frame_cast_in_place(log: PlanLog) -> PlanLog:
    """Closed columns on the edges of a beam: they reach as far as its cells, and do not fill them."""
    low, high = np.array((1.0, 1.0, 3.4)), np.array((5.0, 2.0, 3.6))
    edges = [(x, y) for x in (low[0], high[0] - 0.001) for y in (low[1], high[1] - 0.001)]
    columns = [box_mesh((x, y, low[2]), (x + 0.001, y + 0.001, high[2])) for x, y in edges]
    return with_component(cast_in_place(log, "slab"), "slab", mesh=TriangleMesh.joined(columns))


def an_open_mesh_cast_in_place(log: PlanLog) -> PlanLog:
    """No fault of the plan: the model has an open mesh, and nobody lifts it."""
    return with_component(cast_in_place(log, "slab"), "slab", mesh=thin_columns((1.0, 1.0, 3.4), (5.0, 2.0, 3.6)))


def in_order(log: PlanLog, *names: str) -> PlanLog:
    """Return the log with its lifts in another order; their motions stay as they are."""
    orders = {index_of(log, name): n for n, name in enumerate(names)}
    lifts = sorted(
        (dataclasses.replace(lift, order=orders[lift.component]) for lift in log.plan.lifts), key=lambda one: one.order
    )
    motions = sorted(
        (dataclasses.replace(one, order=orders[one.component]) for one in log.motions), key=lambda one: one.order
    )
    return dataclasses.replace(with_plan(log, lifts=tuple(lifts)), motions=tuple(motions))


def a_beam_by_other_means_before_its_columns(log: PlanLog) -> PlanLog:
    """Nobody lifts the beam, and nothing carries it when it is its turn."""
    reason = "governing radius 12.0 m, at its place: 9000 kg"
    spoiled = with_lift(unplanned(log, "beam", reason), "beam", by_other_means=True)
    return in_order(spoiled, "beam", "left", "right", "slab")


def a_beam_cast_before_its_columns(log: PlanLog) -> PlanLog:
    return in_order(cast_in_place(log, "beam"), "beam", "left", "right", "slab")


def one_cell_in_an_extract(log: PlanLog) -> PlanLog:
    """The extract carries the slab; the column that is said to stand has only one cell."""
    part = log.plan.site.components[index_of(log, "left")]
    shape, target = shape_of(part.shape.cells[:1] + np.array(part.target_vox))
    alone = log.extract([lift_of(log, "slab").order])
    return with_component(alone, "left", shape=shape, target_vox=target)


def an_extract_in_another_order(log: PlanLog) -> PlanLog:
    """The extract carries the slab; the beam is said to be set before the columns."""
    alone = log.extract([lift_of(log, "slab").order])
    orders = {index_of(log, name): n for n, name in enumerate(("beam", "left", "right"))}
    context = tuple(dataclasses.replace(lift, order=orders[lift.component]) for lift in alone.context)
    return dataclasses.replace(alone, context=tuple(sorted(context, key=lambda lift: lift.order)))


def lifts_left_to_nobody(log: PlanLog) -> PlanLog:
    """An extract that calls its own lift, and one that does not exist, pending."""
    alone = log.extract([log.motions[-1].order])
    return dataclasses.replace(alone, metadata={**alone.metadata, "pending_lifts": "[3, 77]"})


def set_by_other_means_and_lifted_elsewhere(log: PlanLog) -> PlanLog:
    """An extract whose other lifts are both planned and set by other means."""
    alone = log.extract([log.motions[-1].order])
    context = tuple(dataclasses.replace(lift, by_other_means=True) for lift in alone.context)
    return dataclasses.replace(alone, context=context)


# Work that the crane does not do: its steps and the pauses for it, as the log states them.


def log_with_a_cast_beam() -> PlanLog:
    """Return the log of a portal whose beam is cast on its columns: the slab waits until it carries."""
    return log_cast("beam")


def log_that_cures() -> PlanLog:
    """Return the log of a portal whose beam waits until the joints of the columns have cured."""
    return log_cast(rules=Rules(curing=Curing(column_h=20.0)))


def log_cast(*names: str, rules: Rules | None = None) -> PlanLog:
    """Return the log of a portal of which parts are cast in place."""
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    site = box_site(PARTS, structure=[WALL], crane=crane, shape=(40, 30, 24), rules=rules or Rules())
    parts = (
        dataclasses.replace(one, means=Means.IN_SITU, means_reason="the site file says so") if one.id in names else one
        for one in site.components
    )
    site = with_digests(dataclasses.replace(site, components=tuple(parts)))
    entries = tuple(ComponentConfig(global_id=name, means="in_situ") for name in names)
    return with_files(log_of(site), {"site.toml": site_file_of(site, component=entries)})


def telling(change: Callable[[Steps], Steps]) -> Forge:
    """Return the forgery of a log that states other steps than follow from its plan."""

    def forge(log: PlanLog) -> PlanLog:
        forged = dataclasses.replace(log)
        vars(forged)["steps"] = change(log.steps)
        return forged

    return forge


def with_step(steps: Steps, **by_ns: int) -> Steps:
    (step,) = steps.steps
    return dataclasses.replace(
        steps, steps=(dataclasses.replace(step, **{key: getattr(step, key) + ns for key, ns in by_ns.items()}),)
    )


def with_pause(steps: Steps, **by_ns: int) -> Steps:
    (pause,) = steps.pauses
    return dataclasses.replace(
        steps, pauses=(dataclasses.replace(pause, **{key: getattr(pause, key) + ns for key, ns in by_ns.items()}),)
    )


def a_shorter_wait(steps: Steps) -> Steps:
    """The beam carries a day earlier than the rules ask for, and the slab comes then."""
    return with_pause(with_step(steps, carries_ns=-_DAY_NS), length_ns=-_DAY_NS)


_DAY_NS = 86_400 * 10**9
NOT_ITS_STEPS: dict[str, tuple[Callable[[Steps], Steps], str]] = {
    "set before it carries": (
        lambda steps: with_pause(steps, length_ns=-_DAY_NS),
        r"lift 4 \(slab\): it is there at .* s of elapsed time; beam under it carries from",
    ),
    "no pause": (
        lambda steps: dataclasses.replace(steps, pauses=()),
        r"lift 4 \(slab\): it is there at .* s of elapsed time; beam under it carries from",
    ),
    "a shorter wait": (
        a_shorter_wait,
        r"lift 3 \(beam\): it carries 518400 s after the work; the rules ask for 604800 s",
    ),
    "no work": (
        lambda steps: with_step(steps, begins_ns=10**12),
        r"lift 3 \(beam\): the work takes .* s; the rules ask for",
    ),
    "before the columns": (
        lambda steps: with_step(steps, begins_ns=-(10**9), ends_ns=-(10**9)),
        r"lift 3 \(beam\): it begins at .* s, before lift 2 is set",
    ),
    "a step twice": (
        lambda steps: dataclasses.replace(steps, steps=steps.steps * 2),
        "there are 2 steps; 1 parts are not set by the crane",
    ),
    "a pause for nothing": (
        lambda steps: with_pause(steps, length_ns=_DAY_NS),
        "the pause before lift 4 ends when nothing begins to carry",
    ),
    "a pause under load": (
        lambda steps: with_pause(steps, at_ns=10**11 * 2),
        r"the pause before lift 4: lifts \[4\] hang on their hooks meanwhile",
    ),
    "a pause elsewhere": (
        lambda steps: with_pause(steps, at_ns=-(10**9)),
        "the pause before lift 4 is at .* s, where that lift does not begin",
    ),
    "a pause twice": (
        lambda steps: dataclasses.replace(steps, pauses=steps.pauses * 2),
        "a lift has two pauses",
    ),
}
"""Steps and pauses that do not fit the plan, each with what the refusal says."""
NOT_CURED: dict[str, tuple[Callable[[Steps], Steps], str]] = {
    "a shorter pause": (
        lambda steps: with_pause(steps, length_ns=-(10**12)),
        r"lift 3 \(beam\): it is there at .* s of elapsed time; the joints of (left|right) under it have cured at",
    ),
    "a longer pause": (
        lambda steps: with_pause(steps, length_ns=10**12),
        "the pause before lift 3 ends when nothing begins to carry",
    ),
}
"""Pauses that do not fit the joints of the plan, each with what the refusal says."""


def everything_unheld(log: PlanLog) -> PlanLog:
    return with_plan(log, unheld=tuple(component.id for component in log.plan.site.components))


# What no proof of a path can see: lifts that are called infeasible, and the fewest moves.


def unplanned(log: PlanLog, name: str, reason: str, blocked_by: tuple[str, ...] = ()) -> PlanLog:
    """The log without the path and the motion of a lift."""
    order = lift_of(log, name).order
    nothing: dict[str, Any] = {"method": None, "path_vox": None, "shortest_moves": None, "contact_moves": 0}
    spoiled = with_lift(log, name, status=Status.INFEASIBLE, reason=reason, blocked_by=blocked_by, **nothing)
    return dataclasses.replace(spoiled, motions=tuple(m for m in log.motions if m.order != order))


def called_infeasible(log: PlanLog, name: str, reason: str, blocked_by: tuple[str, ...] = ()) -> PlanLog:
    """The same, with a clock as if the lift had never been planned."""
    spoiled = unplanned(log, name, reason, blocked_by)
    site = spoiled.plan.site
    return dataclasses.replace(spoiled, motions=time_plan(spoiled.plan, prepare(site)))


def infeasible_for(reason: str, *blocked_by: str) -> Forge:
    return lambda log: called_infeasible(log, "slab", reason, blocked_by)


FALSE_CLAIMS: dict[str, tuple[Forge, str]] = {
    "blocked": (infeasible_for("it is blocked at its place", "wall"), "(slab): it is called infeasible (it is blocked"),
    "unsupported": (
        infeasible_for("the parts that support it are not in place", "beam"),
        "(slab): it is called infeasible (the parts that support it",
    ),
    "enclosed": (
        infeasible_for(
            "no path leads out of the free space around its place (7 placements); checked with cells", "wall"
        ),
        "(slab): it is called infeasible (no path leads out",
    ),
    "heavy": (infeasible_for("governing radius 12.0 m, at its place: 9000 kg"), "(slab): it is called infeasible (gov"),
    "no room": (
        infeasible_for("the yard has no free place for it (4x1x0.5 m)"),
        "(slab): it is called infeasible (the",
    ),
    "not proven": (
        infeasible_for("its lift could not be proven: triangles: slab: meets beam"),
        "(slab): it is called infeasible (its lift could not be proven",
    ),
    "not driven": (
        infeasible_for("the crane cannot drive its path: slab: the rope is too short"),
        "(slab): it is called infeasible (the crane cannot drive",
    ),
    "fewer": (
        lambda log: with_lift(log, "beam", shortest_moves=lift_of(log, "beam").shortest_moves - 1),
        "(beam): shortest_moves is ",
    ),
    "none": (lambda log: with_lift(log, "left", shortest_moves=0), "(left): shortest_moves is 0, the fewest possible"),
}
"""Logs that every check but ``search`` accepts, each with what ``search`` says."""


# Lifts that give way in vain: each could keep more.


def careful_log() -> PlanLog:
    """Return the log of the same portal with the clearances of a site file that says nothing about them."""
    crane = test_crane(base=(10.0, -4.0, 0.0), jib=40.0, height=14.0)
    rules = RulesConfig(wind_speed_m_s=0.0).rules(has_crane=True)
    return log_of(box_site(PARTS, structure=[WALL], crane=crane, shape=(40, 30, 24), rules=rules))


def every_lift_as_low_as_it_can(log: PlanLog) -> PlanLog:
    """The forger plans without clearances, and says that no lift finds a way with any."""
    site = log.plan.site
    low = dataclasses.replace(
        site,
        rules=dataclasses.replace(site.rules, transit_clearance_m=0.0, rope_clearance_m=0.0, gives_way=()),
    )
    preparation = prepare(low)
    plan = plan_lifts(low, preparation)
    lifts = tuple(dataclasses.replace(lift, clearance_m=0.0, rope_clearance_m=0.0) for lift in plan.lifts)
    motions = tuple(time_plan(plan, preparation))
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, lifts=lifts), motions=motions)


_NEXT = "but a path keeps "
GIVES_WAY_IN_VAIN: dict[str, tuple[Forge, str]] = {
    "the load": (
        lambda log: with_lift(log, "beam", clearance_m=0.0),
        f"(beam): it keeps 0 m around its load and 0.5 m around hook and rope, {_NEXT}0.5 m around its load",
    ),
    "the rope": (
        lambda log: with_lift(log, "beam", rope_clearance_m=0.0),
        f"(beam): it keeps 2 m around its load and 0 m around hook and rope, {_NEXT}2 m around its load and 0.5 m",
    ),
    "by a value of its own": (
        lambda log: with_lift(log, "slab", clearance_m=0.7),
        f"(slab): it keeps 0.7 m around its load and 0.5 m around hook and rope, {_NEXT}1.5 m around its load",
    ),
    "both": (
        lambda log: with_lift(log, "left", clearance_m=1.0, rope_clearance_m=0.0),
        f"(left): it keeps 1 m around its load and 0 m around hook and rope, {_NEXT}1.5 m around its load and 0 m",
    ),
    "upended": (
        lambda log: with_lift(log, "left", upending_clearance_m=0.5),
        "(left): it keeps 0.5 m of upending_clearance_m, but could keep 2 m",
    ),
    "on its last moves": (
        lambda log: with_lift(log, "beam", approach_clearance_m=0.0),
        "(beam): it keeps 0 m of approach_clearance_m, but could keep 0.5 m",
    ),
    "every lift": (
        every_lift_as_low_as_it_can,
        f"(left): it keeps 0 m around its load and 0 m around hook and rope, {_NEXT}",
    ),
}
"""Logs that every check but ``search`` accepts, from ``careful_log``, each with what ``search`` says."""


def kept_headings_in_vain() -> PlanLog:
    """Return the log of a site whose loads turn with the jib, in which none does: each has room to."""
    kept = log_of(turning_site(HeadingRule.KEPT))
    return with_site(kept, rules=dataclasses.replace(kept.plan.site.rules, heading=HeadingRule.WITH_JIB))


# A slab that a crew guides in between the flanges of two beams.


def log_of_a_guided_slab() -> PlanLog:
    """Return the log of a slab that goes in under two flanges, one end first."""
    return log_of(slab_between_beams())


def guided_by(log: PlanLog, **changes: Any) -> PlanLog:
    guide = lift_of(log, "slab").guide
    return with_lift(log, "slab", guide=dataclasses.replace(guide, **changes))


def with_poses(change: Callable[[float, float, float], tuple[float, float, float]]) -> Forge:
    """Return a forger that changes the height, the distance aside and the tilt of every pose."""
    return lambda log: guided_by(log, poses=tuple(change(*pose) for pose in lift_of(log, "slab").guide.poses))


def guided_at_the_speed_of_the_crane(log: PlanLog) -> PlanLog:
    """Return the log with the motion of a lift that nobody guides."""
    guide = lift_of(log, "slab").guide
    alone = retimed(with_lift(log, "slab", guide=None))
    return with_lift(alone, "slab", guide=guide)


def a_cable_where_only_the_guided_slab_goes(log: PlanLog) -> PlanLog:
    component = log.plan.site.components[index_of(log, "slab")]
    x, y, z = component.target_vox
    return with_blocker(log, "cable", [(x - 1, y, z + 1)])


GUIDED: dict[str, tuple[Forge, str]] = {
    "nobody": (lambda log: with_lift(log, "slab", guide=None), "slab: meets west deeper than it may"),
    "level": (with_poses(lambda up, aside, tilt: (up, aside, 0.0)), "slab: guided to its place, meets "),
    "half the tilt": (with_poses(lambda up, aside, tilt: (up, aside, tilt / 2.0)), "slab: guided to its place, meets "),
    "tilted the other way": (
        with_poses(lambda up, aside, tilt: (up, aside, -tilt)),
        "slab: guided to its place, meets",
    ),
    "in line": (with_poses(lambda up, aside, tilt: (up, 0.0, tilt)), "slab: guided to its place, meets "),
    "across": (lambda log: guided_by(log, heading_rad=np.pi / 2.0), "slab: guided to its place, meets "),
    "far aside": (with_poses(lambda up, aside, tilt: (up, 9.0 * aside, tilt)), "held 0.54 m aside; 0.3 m at most"),
    "steep": (with_poses(lambda up, aside, tilt: (up, aside, 9.0 * tilt)), "degrees; 11.5 at most"),
    "not level at its place": (
        with_poses(lambda up, aside, tilt: (up, aside, tilt + 0.01)),
        "it does not come down from level above its place to its place",
    ),
    "up and down": (
        with_poses(lambda up, aside, tilt: (up if up in (0.0, 1.0) else 1.0 - up, aside, tilt)),
        "it does not come down from level",
    ),
    "from halfway": (
        with_poses(lambda up, aside, tilt: (up / 2.0, aside, tilt)),
        "do not begin where its last moves do",
    ),
    "about an end": (
        lambda log: guided_by(log, centre_m=(4.0, 4.6, 3.495)),
        "it is not tilted about its centre of mass",
    ),
    "at the speed of the crane": (guided_at_the_speed_of_the_crane, "is guided aside faster than a crew can"),
    "a cable": (a_cable_where_only_the_guided_slab_goes, "slab: guided to its place, it comes into cells near cable"),
    "too heavy to hold": (
        lambda log: with_component(log, "slab", mass_kg=60_000.0),
        "N; 1000 N at most",
    ),
    "nan": (with_poses(lambda up, aside, tilt: (up, float("nan"), tilt)), "guide.poses: nan is not a coordinate"),
}
"""Logs of the guided slab that must be refused, each with what the refusal says."""


# Loads that turn with the jib.


def log_of_turning_loads() -> PlanLog:
    """Return the log of a portal whose four loads turn with the jib."""
    return log_of(turning_site(transit_clearance_m=2.0))


def the_other_site_file(log: PlanLog) -> PlanLog:
    """Attach a site file by which tag lines keep the heading of loads."""
    site = log.plan.site
    other = dataclasses.replace(site, rules=dataclasses.replace(site.rules, heading=HeadingRule.KEPT))
    return with_files(log, {**log.attachments, "site.toml": site_file_of(other)})


def turned_faster(log: PlanLog) -> PlanLog:
    """Take a second from the turn of the beam; all that follows comes a second earlier."""
    order = lift_of(log, "beam").order
    motion, less_ns = log.motions[order], 10**9
    _, end_ns = motion.turned_ns
    loaded = motion.loaded
    late = loaded.time_ns + motion.start_ns >= end_ns
    phases = tuple(
        dataclasses.replace(
            phase,
            start_ns=phase.start_ns - less_ns * (phase.start_ns >= end_ns),
            end_ns=phase.end_ns - less_ns * (phase.end_ns >= end_ns),
        )
        for phase in motion.phases
    )
    sooner = dataclasses.replace(loaded, time_ns=loaded.time_ns - less_ns * late)
    log = with_motion(log, order, loaded=sooner, phases=phases, end_ns=motion.end_ns - less_ns)
    return moved_on_the_clock(log, order + 1, -less_ns)


def moved_on_the_clock(log: PlanLog, first: int, by_ns: int) -> PlanLog:
    """Return the log with all lifts from one on earlier or later."""
    motions = tuple(
        dataclasses.replace(
            motion,
            start_ns=motion.start_ns + by_ns,
            end_ns=motion.end_ns + by_ns,
            phases=tuple(
                dataclasses.replace(phase, start_ns=phase.start_ns + by_ns, end_ns=phase.end_ns + by_ns)
                for phase in motion.phases
            ),
        )
        if motion.order >= first
        else motion
        for motion in log.motions
    )
    return dataclasses.replace(log, motions=motions)


def kept_and_called_turning(log: PlanLog) -> PlanLog:
    """Return the plan by which tag lines keep all headings, without their time, as one of loads that turn."""
    kept = log_of(turning_site(HeadingRule.KEPT, transit_clearance_m=2.0))
    lifts = tuple(dataclasses.replace(lift, with_jib=True) for lift in kept.plan.lifts)
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, lifts=lifts), motions=kept.motions)


def a_mast_where_only_the_turning_beam_comes(log: PlanLog) -> PlanLog:
    _, low, high = BESIDE_THE_PORTAL[0]
    cells = box_cells(log.plan.site.frame, low, high)
    top = cells[:, 2] <= lift_of(log, "beam").last_moves_vox[0, 2]
    return with_blocker(log, "mast", cells[top])


TURNING: dict[str, tuple[Forge, str]] = {
    "by other rules": (
        lambda log: with_rules(log, heading=HeadingRule.KEPT),
        "turns with the jib, but the rules of the site keep headings by tag line",
    ),
    "by another site file": (the_other_site_file, "heading"),
    "in less time": (turned_faster, "; the rules ask for 14."),
    "at a faster rate": (lambda log: with_rules(log, turn_s=60.0), "; the rules ask for 33."),
    "not at all": (
        lambda log: with_lift(log, "beam", with_jib=False),
        "its load is turned on its way, but tag lines keep its heading",
    ),
    "and kept": (kept_and_called_turning, "degrees off its heading"),
    "into a mast": (a_mast_where_only_the_turning_beam_comes, "turning, it meets mast"),
    "elsewhere": (
        lambda log: with_lift(log, "beam", contact_moves=lift_of(log, "beam").contact_moves + 1),
        "is not turned to its final heading where its last moves begin",
    ),
}
"""Loads that turn otherwise than the plan says, each with what the refusal says."""


# A plan that is carried out among people and vehicles.


def log_among_others() -> PlanLog:
    """Return the log of the portal, carried out among two crews and a lorry."""
    log = good_log()
    named = traffic_named("3")
    done, _, _ = carry_out(log, prepare(log.plan.site), named.traffic, named.source, None, SilentProgress())
    return done


def carried_out_with(change: Callable[[CarriedOut], Mapping[str, Any]]) -> Forge:
    """Return a forgery of the execution alone, with what it gives for its fields."""

    def forge(log: PlanLog) -> PlanLog:
        assert log.carried_out is not None
        return dataclasses.replace(log, carried_out=dataclasses.replace(log.carried_out, **change(log.carried_out)))

    return forge


def counted_with(**changes: Any) -> Forge:
    """Return a forgery of what an execution says that happened."""
    return carried_out_with(lambda found: {"tally": dataclasses.replace(found.tally, **changes)})


def stands_at(row: int, other: int) -> Forge:
    """Return a forgery by which somebody stands all the time where the hook is at a sample."""

    def forge(log: PlanLog) -> PlanLog:
        found = log.carried_out
        assert found is not None
        at_m = hook_of(log.plan.site.cranes[0], *found.axes[row : row + 1].T)[0, :2]
        place_m, seen_m = found.place_m.copy(), found.seen_m.copy()
        place_m[:, other] = seen_m[:, other] = at_m
        return dataclasses.replace(log, carried_out=dataclasses.replace(found, place_m=place_m, seen_m=seen_m))

    return forge


def moved_at(name: str, rows: slice, other: int, by_m: float) -> Forge:
    """Return a forgery that moves somebody, or where they are seen, at some samples."""

    def change(found: CarriedOut) -> Mapping[str, Any]:
        moved = getattr(found, name).copy()
        moved[rows, other] += by_m
        return {name: moved}

    return carried_out_with(change)


def without_sample(found: CarriedOut) -> Mapping[str, Any]:
    names = ("time_ns", "plan_ns", "pace", "axes", "place_m", "seen_m")
    return {name: np.delete(getattr(found, name), 100, axis=0) for name in names}


def on_the_plans_clock(change: Callable[[np.ndarray], np.ndarray]) -> Forge:
    """Return a forgery of where the crane was on the plan's clock; its axes and its pace follow."""

    def forge(log: PlanLog) -> PlanLog:
        found = log.carried_out
        assert found is not None
        plan_ns = change(found.plan_ns.copy())
        pace = np.concatenate([[0.0], np.diff(plan_ns) / 5e8])
        axes = planned_axes(log.motions, plan_ns)
        return dataclasses.replace(log, carried_out=dataclasses.replace(found, plan_ns=plan_ns, pace=pace, axes=axes))

    return forge


def sped_up(plan_ns: np.ndarray) -> np.ndarray:
    plan_ns[1:] = np.minimum(plan_ns[1:] * 2, plan_ns[-1])
    return plan_ns


def stopped_at_once(log: PlanLog) -> PlanLog:
    """The crane stands still for a while in the middle of a traverse, from one sample to the next."""
    motion = log.motions[1]
    middle_ns = (motion.raised_ns + motion.set_ns) // 2

    def stand(plan_ns: np.ndarray) -> np.ndarray:
        row = int(np.searchsorted(plan_ns, middle_ns))
        return np.concatenate([plan_ns[:row], np.repeat(plan_ns[row], 20), plan_ns[row:-20]])

    return on_the_plans_clock(stand)(log)


def _axis_off(found: CarriedOut) -> Mapping[str, Any]:
    axes = found.axes.copy()
    axes[200, 0] += 0.01
    return {"axes": axes}


def _one_name(found: CarriedOut) -> Mapping[str, Any]:
    return {"others": (found.others[0], found.others[0], *found.others[2:])}


def _under_the_second_load(log: PlanLog) -> PlanLog:
    found, motion = log.carried_out, log.motions[1]
    assert found is not None
    row = int(np.searchsorted(found.plan_ns, (motion.raised_ns + motion.set_ns) // 2))
    return stands_at(row, 0)(log)


def _under_and_said_so(log: PlanLog) -> PlanLog:
    """Somebody is under the load, and the counts say so."""
    log = _under_the_second_load(log)
    found = log.carried_out
    assert found is not None
    return dataclasses.replace(
        log, carried_out=dataclasses.replace(found, tally=tally_of(log.plan, log.motions, found))
    )


def cut_after(samples: int) -> Forge:
    """Return a forgery that ends an execution early; its counts are those of what is left."""

    def forge(log: PlanLog) -> PlanLog:
        found = log.carried_out
        assert found is not None
        names = ("time_ns", "plan_ns", "pace", "axes", "place_m", "seen_m")
        cut = dataclasses.replace(found, **{name: getattr(found, name)[:samples] for name in names})
        return dataclasses.replace(
            log, carried_out=dataclasses.replace(cut, tally=tally_of(log.plan, log.motions, cut))
        )

    return forge


AMONG_OTHERS: dict[str, tuple[Forge, str]] = {
    "a person under the load": (_under_the_second_load, " m within its suspended load"),
    "and the counts say so": (_under_and_said_so, " m within its suspended load"),
    "a person who jumps": (moved_at("place_m", slice(500, 501), 0, 5.0), "crew 1 moves at "),
    "a lorry shifted": (moved_at("place_m", slice(None), 2, 5.0), "lorry 1 is seen "),
    "seen elsewhere": (moved_at("seen_m", slice(40, 41), 1, 1.0), "crew 2 is seen "),
    "not a number": (moved_at("place_m", slice(7, 8), 1, float("nan")), "not equally many, or not numbers"),
    "a sample deleted": (carried_out_with(without_sample), "one is missing or has another time"),
    "two of one name": (carried_out_with(_one_name), "two of the others have one name"),
    "an axis elsewhere": (carried_out_with(_axis_off), "at 100.0 s an axis is 0.01 (rad or m) off the proven way"),
    "another pace": (
        carried_out_with(lambda found: {"pace": np.where(found.pace > 0.5, 0.2, found.pace)}),
        "its pace does not fit where it is on the plan's clock",
    ),
    "faster than planned": (on_the_plans_clock(sped_up), "the crane is faster than planned"),
    "backwards": (
        on_the_plans_clock(lambda plan_ns: np.concatenate([plan_ns[:300], plan_ns[200:-100]])),
        "the crane goes back on its way",
    ),
    "on after its end": (
        on_the_plans_clock(lambda plan_ns: plan_ns + np.linspace(0, 2 * 10**9, len(plan_ns)).astype(np.int64)),
        "goes on after its end",
    ),
    "stopped at once": (stopped_at_once, "speeds up or brakes at"),
    "cut to two samples": (cut_after(2), "lifts are left: 0 of 4 were carried out before the samples end"),
    "cut before its end": (cut_after(-1), "lifts are left: 3 of 4 were carried out before the samples end"),
    "a lift more": (counted_with(delivered=5), "delivered is said to be 5; the samples give 4"),
    "less time lost": (counted_with(lost_s=0.0), "lost_s is said to be 0.0"),
    "fewer stops": (counted_with(stops=-1), "stops is said to be -1"),
    "more waits": (counted_with(waits=999), "waits is said to be 999"),
    "further away": (counted_with(least_m=99.0), "least_m is said to be 99.0"),
    "nobody there": (counted_with(least_m=None), "least_m is said to be None"),
    "a violation": (counted_with(violations=1), "violations is said to be 1; the samples give 0"),
}
"""Executions that must be refused, each with what the refusal says."""
