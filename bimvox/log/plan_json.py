"""The lift plan as JSON inside the log. The paths themselves are on ``/crane/path/planned``."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Collection, Iterable, Mapping
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import LogFileError
from bimvox.log.bundle import from_npy, pack, to_npy, unpack
from bimvox.log.codec import DTYPES, ArrayReader, ArrayWriter, DecodeError, decode, encode
from bimvox.records.lift import Epoch, Guide, LeftPath, Lift, LiftPlan, ModelledClash, Status, yard_place
from bimvox.revision.current_plan import HeldCranes
from bimvox.site.component import Component, IntVec, StoredPose
from bimvox.site.site import Blocker, Site
from bimvox.sparse import names_to_write
from bimvox.stop.redirect import Held

# Held cranes as a file inside the log: after ``kill -9`` they go on from where they stopped. A zip like the site's
# (``bundle``): plain values in JSON, arrays next to them.

HELD_FILE = "held_load.zip"
"""Name of the attachment with the load of a single crane."""
HELD_CRANES_FILE = "held_cranes.zip"
"""Name of the attachment with several cranes, all of which are held."""

_VALUES = "held.json"


T = TypeVar("T", Held, HeldCranes)


def held_files(held: HeldCranes) -> dict[str, bytes]:
    """Return the attachment that holds the cranes; of a single crane it says its load only."""
    name, what = (HELD_CRANES_FILE, held) if held.hooks else (HELD_FILE, held.loads[0])
    arrays = ArrayWriter()
    values = json.dumps(encode(what, arrays), ensure_ascii=False, separators=(",", ":")).encode()
    return {name: pack({_VALUES: values} | {f"{dtype}.npy": to_npy(flat) for dtype, flat in arrays.flat().items()})}


def held_in(attachments: Mapping[str, bytes]) -> HeldCranes | None:
    """Return the held cranes of a log; None if none are.

    Raises:
        LogFileError: If the attachment is damaged.
    """
    if HELD_CRANES_FILE in attachments:
        return _from_bytes(attachments[HELD_CRANES_FILE], HeldCranes, HELD_CRANES_FILE)
    if HELD_FILE in attachments:
        return HeldCranes((_from_bytes(attachments[HELD_FILE], Held, HELD_FILE),))
    return None


def _from_bytes(data: bytes, kind: type[T], name: str) -> T:
    try:
        members = unpack(data)
        flat = {dtype: from_npy(members[f"{dtype}.npy"], dtype) for dtype in DTYPES if f"{dtype}.npy" in members}
        held: T = decode(kind, json.loads(members[_VALUES]), ArrayReader(flat), "held")
    except (ValueError, KeyError, RecursionError) as error:
        raise LogFileError(name, f"the held load cannot be read: {error}") from error
    return held


_VERSION = 1
LIFTS_KEPT = 4096
"""Number of lifts whose JSON is kept in memory."""
_NO_ARRAYS = ArrayReader({})


def plan_to_json(plan: LiftPlan, context: Collection[Lift] = ()) -> bytes:
    """Return a plan as JSON.

    Args:
        plan: The plan; its lifts are marked ``carried``.
        context: Lifts of the same plan that this log does not carry (it is an extract), so that the state of the
            building before every carried lift is known.
    """
    marked = [(lift, True) for lift in plan.lifts] + [(lift, False) for lift in context]
    document = {
        "version": _VERSION,
        "clashes": [encode(clash, ArrayWriter()) for clash in plan.clashes],
        "notes": list(plan.notes),
        "unheld": list(plan.unheld),
    }
    if plan.history:
        document["history"] = [
            {
                "until_ns": epoch.until_ns,
                "obstructions": [{"id": one.id, "cells": one.cells.tolist()} for one in epoch.obstructions],
            }
            for epoch in plan.history
        ]
    lifts = []
    for lift, carried in sorted(marked, key=lambda entry: entry[0].order):
        component = plan.site.components[lift.component]
        crane = plan.site.crane_of(component)
        sling_m = None if crane is None else crane.sling_m
        lifts.append(_lift_text(lift, component, sling_m, plan.site.frame.voxel_size_m, carried))
    return _lines("lifts", lifts, document)


def lines_of(name: str, entries: Iterable[Any]) -> bytes:
    """Return a JSON document with a list, one entry a line: readable, and quick to write."""
    return _lines(name, map(_text, entries), {})


def _lines(name: str, texts: Iterable[str], others: Mapping[str, Any]) -> bytes:
    values = {key: _text(value) for key, value in others.items()}
    values[name] = "[\n" + ",\n".join(texts) + "\n]"
    return ("{\n" + ",\n".join(f'"{key}": {text}' for key, text in values.items()) + "\n}\n").encode()


_text = json.JSONEncoder(ensure_ascii=False).encode


def plan_from_json(
    data: bytes, site: Site, paths: Mapping[int, NDArray[np.int32]], name: str, *, partial: bool = False
) -> tuple[LiftPlan, tuple[Lift, ...]]:
    """Return the plan of a log, and the lifts that the log does not carry.

    ``paths``: (N, 3) int32 reference cells by lift order; ``name``: its source, for messages; ``partial``: accept
    planned lifts without a path (of a recovered log), as not carried.

    Raises:
        LogFileError: If it is damaged or does not fit the site or the paths.
    """
    try:
        return _read(json.loads(data), site, paths, partial)
    except (ValueError, RecursionError) as error:
        raise LogFileError(name, f"the plan in it cannot be read: {error}") from error


def _read(
    document: Any, site: Site, paths: Mapping[int, NDArray[np.int32]], partial: bool
) -> tuple[LiftPlan, tuple[Lift, ...]]:
    if not isinstance(document, dict) or document.get("version") != _VERSION:
        raise DecodeError(f"not a plan of version {_VERSION}")
    records = document.get("lifts")
    if not isinstance(records, list):
        raise DecodeError("lifts: not a list")
    carried: list[Lift] = []
    context: list[Lift] = []
    last = -1
    for n, record in enumerate(records):
        lift, is_carried = _lift_from_json(record, site, f"lifts[{n}]")
        if lift.order <= last:
            raise DecodeError(f"lifts[{n}].order: {lift.order} does not follow {last}")
        last = lift.order
        path = paths.get(lift.order)
        if is_carried and lift.status is Status.PLANNED:
            if path is None and not partial:
                raise DecodeError(f"lifts[{n}]: its path is not in the log")
            is_carried = path is not None
            lift = dataclasses.replace(lift, path_vox=path)
            if path is not None and record["moves"] != lift.moves:
                raise DecodeError(f"lifts[{n}]: {record['moves']} moves, but its path has {lift.moves}")
        (carried if is_carried else context).append(lift)
    clashes = decode(tuple[ModelledClash, ...], document.get("clashes"), _NO_ARRAYS, "clashes")
    notes = decode(tuple[str, ...], document.get("notes"), _NO_ARRAYS, "notes")
    unheld = decode(tuple[str, ...], document.get("unheld", []), _NO_ARRAYS, "unheld")
    history = tuple(_epoch_from_json(one, site, f"history[{n}]") for n, one in enumerate(document.get("history", ())))
    if [epoch.until_ns for epoch in history] != sorted({epoch.until_ns for epoch in history}):
        raise DecodeError("history: its times do not ascend")
    return LiftPlan(site, tuple(carried), clashes, notes, unheld, history), tuple(context)


def _epoch_from_json(record: Any, site: Site, where: str) -> Epoch:
    if not isinstance(record, dict) or type(record.get("until_ns")) is not int:
        raise DecodeError(f"{where}: not a time and obstructions")
    found = []
    for n, one in enumerate(record.get("obstructions") or ()):
        if not isinstance(one, dict) or not isinstance(one.get("id"), str):
            raise DecodeError(f"{where}.obstructions[{n}]: not an obstruction")
        cells = _cells(one.get("cells"), f"{where}.obstructions[{n}].cells")
        if cells.size and (cells.min() < 0 or (cells >= site.shape).any()):
            raise DecodeError(f"{where}.obstructions[{n}].cells: not cells of the grid")
        found.append(Blocker(one["id"], "obstruction", cells))
    return Epoch(record["until_ns"], tuple(found))


def _cells(value: Any, where: str) -> NDArray[np.int32]:
    """Return (N, 3) int32 cells from a JSON list."""
    if not isinstance(value, list) or not all(
        isinstance(cell, list) and len(cell) == 3 and all(type(n) is int and abs(n) < 2**30 for n in cell)
        for cell in value
    ):
        raise DecodeError(f"{where}: not a list of cells")
    cells = np.array(value, np.int32).reshape(-1, 3)
    cells.flags.writeable = False
    return cells


@lru_cache(maxsize=2 * LIFTS_KEPT)
def _lift_text(lift: Lift, component: Component, sling_m: float | None, voxel_size_m: float, carried: bool) -> str:
    """Return the JSON of a lift; a watched plan writes most of its lifts again and again."""
    place = lift.place
    arrays = ArrayWriter()
    bare = {
        name: None if name == "place" else encode(getattr(lift, name), arrays)
        for name in names_to_write(lift)
        if name not in ("path_vox", "left")
    }
    if lift.left:
        bare["left"] = [
            {"path_vox": one.path_vox.tolist(), "contact_moves": one.contact_moves, "until_ns": one.until_ns}
            | ({} if one.guide is None else {"guide": encode(one.guide, arrays)})
            | ({"with_jib": True} if one.with_jib else {})
            for one in lift.left
        ]
    record = {
        "id": component.id,
        "global_id": component.global_id,
        "carried": carried,
        "moves": lift.moves,
        **bare,
        "place": place
        and {"delivery": place.delivery, "pose": place.pose.value, "cell_vox": [int(n) for n in place.cell_vox]}
        | ({"turn": place.turn, "rise_vox": place.rise_vox} if place.turn else {})
        | ({"stack": place.stack} if place.stack else {})
        | ({"rack": place.rack} if place.rack else {}),
        # Where and how the part hangs: lifting points in site metres, and the hook's height above its top.
        "lifting": {
            "points_m": [list(point) for point in component.lifting.points_m],
            "source": component.lifting.source,
            "sling_m": None if sling_m is None else round(sling_m + component.lifting.sling_rise_vox * voxel_size_m, 6),
            "sail_area_m2": component.sail_area_m2,
            **({} if component.lifting.rig is None else {"rig": component.lifting.rig.document()}),
        },
    }
    return _text(record)


def _lift_from_json(record: Any, site: Site, where: str) -> tuple[Lift, bool]:
    if not isinstance(record, dict) or not isinstance(record.get("carried"), bool) or "moves" not in record:
        raise DecodeError(f"{where}: not a lift")
    added = {"id", "global_id", "carried", "moves", "place", "lifting", "left"}
    lift: Lift = decode(
        Lift, {key: value for key, value in record.items() if key not in added} | {"place": None}, _NO_ARRAYS, where
    )
    if left := record.get("left"):
        lift = dataclasses.replace(lift, left=_left_from_json(left, f"{where}.left"))
    if not 0 <= lift.component < len(site.components):
        raise DecodeError(f"{where}.component: the site has no component {lift.component}")
    component = site.components[lift.component]
    if record.get("id") != component.id:
        raise DecodeError(f"{where}.id: {record.get('id')!r}, but component {lift.component} is {component.id!r}")
    if (place := record.get("place")) is not None:
        if not isinstance(place, dict):
            raise DecodeError(f"{where}.place: not a table")
        pose = decode(StoredPose, place.get("pose"), _NO_ARRAYS, f"{where}.place.pose")
        delivery = decode(int, place.get("delivery"), _NO_ARRAYS, f"{where}.place.delivery")
        cell = decode(IntVec, place.get("cell_vox"), _NO_ARRAYS, f"{where}.place.cell_vox")
        turn = decode(int, place.get("turn", 0), _NO_ARRAYS, f"{where}.place.turn")
        rise = decode(int, place.get("rise_vox", 1), _NO_ARRAYS, f"{where}.place.rise_vox")
        stack = decode(int, place.get("stack", 0), _NO_ARRAYS, f"{where}.place.stack")
        rack = decode(int, place.get("rack", 0), _NO_ARRAYS, f"{where}.place.rack")
        if not 0 <= turn <= 3 or rise < 1:
            raise DecodeError(f"{where}.place: turned by {turn} quarters after a rise of {rise} cells, {pose.value}")
        known = yard_place(component, delivery, pose, cell, turn=turn, rise_vox=rise, stack=stack, rack=rack)
        lift = dataclasses.replace(lift, place=known)
    return lift, record["carried"]


def _left_from_json(value: Any, where: str) -> tuple[LeftPath, ...]:
    found = []
    for n, one in enumerate(value if isinstance(value, list) else [None]):
        if (
            not isinstance(one, dict)
            or type(one.get("until_ns")) is not int
            or type(one.get("contact_moves")) is not int
            or type(one.get("with_jib", False)) is not bool
        ):
            raise DecodeError(f"{where}[{n}]: not an abandoned path")
        path_vox = _cells(one.get("path_vox"), f"{where}[{n}]")
        guide = decode(Guide | None, one.get("guide"), _NO_ARRAYS, f"{where}[{n}].guide")
        with_jib = one.get("with_jib", False)
        found.append(LeftPath(path_vox, one["contact_moves"], one["until_ns"], guide, with_jib))
    return tuple(found)
