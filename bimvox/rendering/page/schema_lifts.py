"""The schema of the page's data: lifts and their motions."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from bimvox.rendering.page.schema_things import Count, Numbers
from bimvox.site.config.validation import Point2, Point3, Table


class PageStep(Table):
    """Work that the crane does not do, elapsed time."""

    begins_s: float
    """When it begins."""
    ends_s: float
    """When it ends."""
    carries_s: float
    """From when it carries."""


class PageUnloading(Table):
    """How the crane brings a part from the truck to its place in the yard; a bound, not a planned motion."""

    radius_m: float
    """Radius of the hook over the truck."""
    utilisation: float
    """Share of the capacity there."""
    crane_s: float
    """Crane time to the yard and back."""


class PageDelivery(Table):
    """A delivery that the crane unloads."""

    number: Count
    """From 0."""
    begins_s: float | None
    """When its unloading begins, local time, seconds after 1970; null without dates."""
    ends_s: float | None
    """When it ends."""


class PageLifting(Table):
    """How a part hangs."""

    source: str
    """Where its lifting points come from."""
    points_m: tuple[Point3, ...]
    """Its lifting points when it is set."""
    sling_m: float | None
    """Hook above the part's top; null without a crane."""
    sail_area_m2: float
    """Its largest area against the wind."""
    permitted_wind_m_s: float | None
    """Gust in which the lift is permitted; null without a crane."""
    rig: dict[str, Any] | None
    """Its gear, as in the log; null if none was chosen."""


class PageGoverning(Table):
    """The sample with the highest utilisation."""

    utilisation: float | None
    """Share of the capacity; null beyond the chart."""
    time_s: float
    """When, crane time."""
    phase: str
    """The phase."""
    radius_m: float
    """Radius of the hook."""
    capacity_kg: float
    """Capacity there."""
    load_kg: float
    """Load, rigging and hook block."""


class PageHook(Table):
    """The hook at pick or set."""

    hook_m: Point3
    """Its position."""
    slew_rad: float
    """Slewing angle from the x axis, counter-clockwise."""
    radius_m: float
    """Its radius."""
    height_m: float
    """Its height."""


class PageLift(Table):
    """A lift."""

    number: Annotated[int, Field(ge=1)]
    """Its number, from 1."""
    order: Count
    """Its position in the sequence, from 0."""
    part: Count
    """Index in ``parts``."""
    status: Literal["planned", "infeasible", "in_situ", "built", "by_hand"]
    """Its status."""
    carried: bool
    """Whether the log carries it."""
    method: str | None
    """How its path was found."""
    moves: Count | None
    """Unit moves of its path."""
    shortest_moves: Count | None
    """The fewest possible."""
    contact_moves: Count | None
    """How many of them are the last moves, near other parts."""
    reason: str | None
    """Why it is infeasible."""
    blocked_by: tuple[str, ...]
    """Ids of what blocks it."""
    by_other_means: bool
    """Whether it counts as set by other means."""
    needed_by_s: float | None
    """When such a part is needed, crane time."""
    elapsed_s: float | None
    """When it starts, elapsed time."""
    step: PageStep | None
    """Its times, if the crane does not lift it."""
    delivery: Count | None
    """Its delivery, from 0."""
    unloading: PageUnloading | None = None
    """How the crane unloads it; null if no place for trucks is known."""
    stored: Literal["as_built", "lying_x", "lying_y"] | None
    """How it is stored."""
    turn: Count
    """Quarter turns of the stored part."""
    start_m: Point3 | None
    """Lowest corner of the stored part's cells."""
    start_size_m: Point3 | None
    """Size of their box."""
    lifting: PageLifting
    """How it hangs."""
    clearance_m: float | None
    """Clearance of the load in transit, if it is less than the rule's."""
    rope_clearance_m: float | None
    """The same of hook and rope."""
    heading: str | None
    """How its heading is kept; null without a path."""
    proven: bool | None
    """Whether the proof holds for it; null without a proof or a path."""
    current: bool
    """Whether it is proven against the current obstructions."""
    duration_s: float | None
    """From pick to set."""
    bound_s: float | None
    """The synchronised point-to-point time."""
    samples: Count | None
    """Samples of its motion in the log."""
    governs: PageGoverning | None
    """Its governing sample."""
    pick: PageHook | None
    """The hook when it is picked."""
    set: PageHook | None
    """The hook when it is set."""
    motion: Count | None
    """Index in ``motions``."""
    begins_s: float | None
    """When its motion begins, crane time."""


class PageTip(Table):
    """The upending of a part that is stored lying."""

    keys: Numbers
    """Columns of steps: time, height of its box's lowest corner, angle to upright."""
    corner_m: Point3
    """Lowest corner of its box."""
    offset_m: Point3
    """From there to its own lowest corner."""
    end_s: float
    """When it stands."""


class PageTurn(Table):
    """A turn back to the final heading."""

    rad: float
    """Angle before it; 0 after it."""
    start_s: float
    """When it begins."""
    end_s: float
    """When it ends."""


class PageWithJib(Table):
    """A load that turns with the jib."""

    from_s: float
    """From when on."""
    slew_rad: float
    """The slewing angle then."""
    turn: PageTurn | None
    """Its turn to the final heading."""


class PageGuide(Table):
    """A load that people hold aside and tilt on its last moves."""

    hook_m: Point3
    """The hook at the set place."""
    height_m: tuple[float, ...]
    """Heights of the hook above it, ascending."""
    aside_m: tuple[float, ...]
    """How far aside at each."""
    tilt_rad: tuple[float, ...]
    """The tilt at each."""
    ahead: Point2
    """The direction of aside."""
    centre_m: Point3
    """The centre of mass at its place."""


class PageMotion(Table):
    """A motion; times are seconds from the lift's start, linear between keyframes."""

    kind: Literal["crane", "carried"]
    """``carried``: without a crane."""
    crane: Count | None = None
    """Its crane, from 0; only with several."""
    keys: Numbers
    """Columns of steps, by ``scales``, each column delta-encoded: time, then slewing angle, radius, height; of a
    carried part time, x, y, z."""
    below_m: Point3 | None = None
    """From the hook to the part's lowest corner."""
    tip: PageTip | None
    """Its upending."""
    yaw: PageTurn | None
    """Its turn, if it is stored turned."""
    with_jib: PageWithJib | None = None
    """When it turns with the jib."""
    guide: PageGuide | None = None
    """How people guide it."""
    phases: tuple[tuple[str, float], ...]
    """Name and start of each phase."""
    lifted_s: float
    """When it leaves its place."""
    arrived_s: float
    """When it is at its place."""
    assembled_s: float
    """When it is fixed."""
    length_s: float
    """When the hook is free."""
