"""Parts that are heavier or larger than a lorry carries, and parts that need no crane."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import TriangleMesh
from bimvox.proof.kept import kept
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about, metres, tonnes
from bimvox.site.component import Component

TRANSPORT = "transport"
HAND_LOAD = "hand_load"

TRUCK_KG = 25_000.0
"""Payload of an articulated lorry: 40 t of Directive 96/53/EC less 14 to 16 t of tractor and trailer."""
TRUCK_LENGTH_M = 13.6
"""Loading length of a semi-trailer within the 16.5 m of Directive 96/53/EC."""
TRUCK_WIDTH_M = 3.0
"""2.55 m by Directive 96/53/EC; up to 3 m goes with a permanent permit and without an escort (German practice)."""
TRUCK_HEIGHT_M = 2.8
"""4.0 m by Directive 96/53/EC less the deck of a semi-trailer at 1.2 m."""
PANEL_HEIGHT_M, PANEL_LENGTH_M, PANEL_WIDTH_M = 3.65, 9.5, 1.5
"""A panel that stands between the wheels of an inloader, whose floor is 0.35 m above the road (data sheets)."""

ROAD_KG = 70_000.0
"""The heaviest precast girders that go by road as a single load (professional judgement)."""
ROAD_LENGTH_M = 40.0
"""The longest girders on a steered dolly (professional judgement)."""
ROAD_WIDTH_M = 5.5
"""Wider than two lanes of a main road less their margins (professional judgement)."""
ROAD_HEIGHT_M = 4.0
"""4.7 m under most bridges less a low bed's deck of 0.7 m (professional judgement)."""

HAND_KG = 25.0
"""What one person lifts close to the body: HSE, Manual handling at work (INDG143), figure 1."""
FEW_HANDS_KG = 75.0
"""What three people or a small hoist handle; a crane lifts such parts by the bundle (professional judgement)."""


def transport(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that needs an escort, or cannot go by road, or needs no crane."""
    for component in subject.lifted:
        if (found := _by_road(component)) is not None:
            yield found
        if component.mass_kg <= HAND_KG:
            said = f"weighs {component.mass_kg:.0f} kg: one person carries that, yet it has a crane lift of its own"
            yield about(component, HAND_LOAD, Severity.MINOR, said)
        elif component.mass_kg <= FEW_HANDS_KG:
            said = f"weighs {component.mass_kg:.0f} kg: such parts are lifted by the bundle, not one by one"
            yield about(component, HAND_LOAD, Severity.MINOR, said)


def _by_road(component: Component) -> Remark | None:
    """Return a remark about a part that no ordinary lorry carries; it is loaded on the side that suits best."""
    length_m, width_m, height_m = sizes_m(component.mesh)
    said = []
    panel = length_m <= PANEL_LENGTH_M and width_m <= PANEL_HEIGHT_M and height_m <= PANEL_WIDTH_M
    if component.mass_kg > TRUCK_KG:
        said.append(f"weighs {tonnes(component.mass_kg)} (a lorry carries {tonnes(TRUCK_KG)})")
    if length_m > TRUCK_LENGTH_M:
        said.append(f"is {metres(length_m)} long (a lorry takes {metres(TRUCK_LENGTH_M)})")
    if width_m > TRUCK_WIDTH_M and not panel:
        said.append(f"is {metres(width_m)} wide (a lorry takes {metres(TRUCK_WIDTH_M)})")
    if height_m > TRUCK_HEIGHT_M:
        said.append(f"is {metres(height_m)} high (a lorry takes {metres(TRUCK_HEIGHT_M)})")
    if not said:
        return None
    is_beyond = (
        component.mass_kg > ROAD_KG or length_m > ROAD_LENGTH_M or width_m > ROAD_WIDTH_M or height_m > ROAD_HEIGHT_M
    )
    what = ", ".join(said)
    if is_beyond:
        return about(component, TRANSPORT, Severity.SERIOUS, f"{what}: it cannot go by road in one piece")
    return about(component, TRANSPORT, Severity.MINOR, f"{what}: a special transport with a permit")


@kept
def sizes_m(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the edges of a part's smallest upright box, the longest first; it may be turned about the vertical."""
    low, high = mesh.bounds_m
    outline = _outline(mesh.vertices_m[:, :2])
    edges = np.roll(outline, -1, axis=0) - outline
    lengths = np.hypot(*edges.T)
    along = edges[lengths > 0.0] / lengths[lengths > 0.0, None]
    if len(along):
        first = outline @ along.T
        second = outline @ np.stack([-along[:, 1], along[:, 0]])
        spans = np.stack([np.ptp(first, axis=0), np.ptp(second, axis=0)])
        plan = spans[:, int(np.argmin(np.round(spans.prod(axis=0), 6)))]
    else:
        plan = (high - low)[:2]
    x, y, z = sorted((*plan.tolist(), float(high[2] - low[2])), reverse=True)
    return x, y, z


def _outline(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of the convex outline of (N, 2) points; of their box if they are on a line."""
    try:
        return np.asarray(points[ConvexHull(points).vertices], np.float64)
    except (QhullError, ValueError):
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
