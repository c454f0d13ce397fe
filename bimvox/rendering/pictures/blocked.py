"""The picture of infeasible lifts: the site before the lift, with the blockers in red."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import listed
from bimvox.records.lift import Lift, Status
from bimvox.rendering.colours import ASSEMBLED, IN_THE_WAY, START_BOX, TARGET_BOX, UNBUILT
from bimvox.rendering.pictures.camera import View
from bimvox.rendering.pictures.cranes import site_cranes
from bimvox.rendering.pictures.picture import PictureOptions, solids_seen
from bimvox.rendering.pictures.scene import LegendEntry, Scene, Swatch
from bimvox.rendering.pictures.site import (
    boxes_strokes,
    site_canvas,
    site_legend,
    stored_cells,
    target_cells,
    view_of_site,
)
from bimvox.rendering.words import counted
from bimvox.site.component import Component
from bimvox.site.site import Site

Cells = NDArray[np.int32]

_ELEVATION_DEG = 34.0
_TURNS = 8
_PROBE = PictureOptions(size_px=(96, 72), samples=1, annotated=False)
_ROOM_M = 2.5
"""Minimum margin around parts and blockers."""
_NEAR = 3.0
"""A blocker is shown up to this many times the size of the part's box."""


def scene_of_blocked(site: Site, lifts: Sequence[Lift], blocked: Sequence[Lift]) -> tuple[Scene, View]:
    """Return the picture of one or more infeasible lifts with the same blockers, and the view that shows most of them.

    The scene is cut to parts and blockers. ``lifts`` are all lifts of the plan.
    """
    first = min(blocked, key=lambda lift: lift.order)
    parts = [site.components[lift.component] for lift in blocked]
    placed = [lift for lift in lifts if lift.is_set and lift.order < first.order]
    ids = tuple(dict.fromkeys(name for lift in blocked for name in lift.blocked_by))
    in_the_way, waiting = _in_the_way(site, lifts, placed, ids)
    canvas = site_canvas(site, len(lifts) * 2 + len(in_the_way) + 2 * len(parts))
    for lift in placed:
        canvas.paint(target_cells(site.components[lift.component]), ASSEMBLED)
    # Only parts of the same delivery lie in the yard at the same time.
    delivery = next((lift.place.delivery for lift in blocked if lift.place is not None), None)
    stored = [lift for lift in blocked if lift.place is not None and lift.place.delivery == delivery]
    for lift in stored:
        canvas.paint(stored_cells(lift), UNBUILT)
    red = [canvas.paint(cells, IN_THE_WAY, over=True) for cells in in_the_way]
    starts = [(lift.place.shape, lift.place.cell_vox) for lift in stored if lift.place is not None]
    cranes, names = site_cranes(site), {part.id: part.name or part.id for part in site.components}
    strokes = (
        *cranes.strokes,
        boxes_strokes(site, starts, START_BOX),
        boxes_strokes(site, [(part.shape, part.target_vox) for part in parts], TARGET_BOX),
        boxes_strokes(site, [(part.shape, part.target_vox) for part in waiting], IN_THE_WAY),
    )
    places = [target_cells(part) for part in parts]
    yard = [stored_cells(lift) for lift in stored]
    blockers = [*in_the_way, *(target_cells(part) for part in waiting)]
    scene = Scene(
        frame=site.frame,
        solids=canvas.solids,
        palette=canvas.palette,
        strokes=strokes,
        blocks=cranes.blocks,
        legend=(
            *site_legend(site),
            *([LegendEntry(f"assembled ({len(placed)})", ASSEMBLED)] if placed else []),
            *(
                [LegendEntry(f"in the way: {listed((names.get(name, name) for name in ids), 3)}", IN_THE_WAY)]
                if in_the_way
                else []
            ),
            *([LegendEntry("not placed itself", IN_THE_WAY, Swatch.BOX)] if waiting else []),
            *([LegendEntry("waits", UNBUILT)] if stored else []),
            *([LegendEntry("start", START_BOX, Swatch.BOX)] if stored else []),
            LegendEntry("target", TARGET_BOX, Swatch.BOX),
        ),
        title=_title(parts),
        caption=first.reason or "",
        focus_m=_focus_m(site, places, yard, blockers),
    )
    return scene, _best_view(site, scene, places, red)


def _in_the_way(
    site: Site, lifts: Sequence[Lift], placed: Sequence[Lift], ids: Sequence[str]
) -> tuple[list[Cells], list[Component]]:
    """Return the cells of the blockers, and the parts that block because they are not placed."""
    cells: list[Cells] = []
    waiting: list[Component] = []
    done = {lift.component for lift in placed}
    of_component = {lift.component: lift for lift in lifts}
    for blocker in site.blockers[1:]:
        if blocker.id in ids:
            above = blocker.cells[blocker.cells[:, 2] > site.ground_vox[blocker.cells[:, 0], blocker.cells[:, 1]]]
            cells.append(above if len(above) else blocker.cells)
    for component in site.components:
        if component.id not in ids:
            continue
        lift = of_component.get(component.index)
        if component.index in done:
            cells.append(target_cells(component))
        elif lift is not None and lift.status is Status.PLANNED and lift.place is not None:
            cells.append(stored_cells(lift))
        else:
            waiting.append(component)
    return cells, waiting


def _focus_m(
    site: Site, targets: Sequence[Cells], starts: Sequence[Cells], blockers: Sequence[Cells]
) -> NDArray[np.float64]:
    """Return the (2, 3) box around the blockers and the parts where they are blocked (at target or in the yard)."""
    places = [group for group in (targets, starts) if group]
    ends = [_box(group) for group in places]
    if not blockers:
        low, high = ends[0]
    else:
        ways = [_box([blocker]) for blocker in blockers]
        gaps = [min(_gap(end, way) for way in ways) for end in ends]
        low, high = ends[int(np.argmin(gaps))]
        room = _NEAR * np.maximum(high - low, _ROOM_M / site.frame.voxel_size_m)
        for way in ways:
            low, high = (
                np.minimum(low, np.maximum(way[0], low - room)),
                np.maximum(high, np.minimum(way[1], high + room)),
            )
    margin = max(_ROOM_M / site.frame.voxel_size_m, 0.15 * float((high - low).max()))
    low, high = np.maximum(low - margin, 0.0), np.minimum(high + margin, site.shape)
    focus: NDArray[np.float64] = site.frame.corner_of(np.stack([low, high]))
    return focus


def _box(groups: Iterable[Cells]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    cells = np.concatenate(list(groups))
    return cells.min(axis=0).astype(np.float64), cells.max(axis=0) + 1.0


def _gap(
    one: tuple[NDArray[np.float64], NDArray[np.float64]], other: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> float:
    """Return the distance between two boxes, cells."""
    apart = np.maximum(np.maximum(one[0] - other[1], other[0] - one[1]), 0.0)
    return float(np.linalg.norm(apart))


def _best_view(site: Site, scene: Scene, places: Sequence[Cells], red: Sequence[int]) -> View:
    """Return the usual view, turned so that it shows most of the blockers and of the parts' places."""
    number = len(scene.palette)
    solids = scene.solids.astype(np.uint32)
    for cells in places:
        at = tuple(cells.T)
        solids[at] = np.where(np.isin(solids[at], red), solids[at], number)
    probe = replace(
        scene, solids=solids, palette=np.concatenate([scene.palette, scene.palette[:1]]), strokes=(), blocks=()
    )
    usual = view_of_site(site)
    best, most = View(usual.azimuth_deg, _ELEVATION_DEG), -1.0
    for turn in range(_TURNS):
        view = View(usual.azimuth_deg + turn * 360.0 / _TURNS, _ELEVATION_DEG)
        seen = solids_seen(probe, replace(_PROBE, view=view))
        # Both must be visible, so the smaller share counts most.
        counts = [int(np.isin(seen, red).sum())] if red else []
        counts.append(int((seen == number).sum()))
        worth = min(counts) + 0.2 * sum(counts)
        if worth > 1.05 * most:
            best, most = view, worth
    return best


def _title(parts: Sequence[Component]) -> str:
    first = parts[0].name or parts[0].id
    return first if len(parts) == 1 else f"{first} and {counted(len(parts) - 1, 'more part')}"
