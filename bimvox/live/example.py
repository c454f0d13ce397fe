"""The job of ``gymnasium.make("bimvox/LiveSite-v0")``: twelve lifts of a real crane between a yard and a frame.

Every part has two ways: straight across, and with the trolley drawn in while slewing.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np

from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s
from bimvox.live.ground import NO_TRACK
from bimvox.live.job import LiveJob, LiveLift
from bimvox.live.traffic import Ground
from bimvox.live.way import Hanging, Way, way_of
from bimvox.motion.move import Move
from bimvox.motion.swing import Pendulum
from bimvox.motion.timeline import in_sequence

_LIFTS = 12
_PENDULUM = Pendulum(4.0)
_TRAVEL_M, _INNER_M = 16.0, 10.0


def example_crane() -> TowerCrane:
    """Return a crane of 155 tm."""
    return TowerCrane(
        name="example",
        base_m=(0.0, 0.0, 0.0),
        mast_size_m=1.6,
        jib_height_m=23.0,
        jib_length_m=45.0,
        min_radius_m=2.8,
        sling_m=3.0,
        rigging_mass_kg=200.0,
        slewing=AxisLimits(0.0838, 0.005236, 0.005236),
        trolley=AxisLimits(0.6333, 0.25, 0.25),
        hoist=AxisLimits(0.6667, 0.3, 0.3),
        chart=LoadChart((15.5, 45.0), (10_000.0, 3_100.0)),
    )


@cache
def example_job() -> LiveJob:
    """Return the job; the parts lie north of the crane and belong to a grid of columns east of it."""
    crane = example_crane()
    picks = [CranePose(math.radians(70.0 + 6.0 * n), 20.0 + 4.0 * (n % 3), 4.0) for n in range(_LIFTS)]
    places = [CranePose(math.radians(-30.0 + 15.0 * (n % 4)), 18.0 + 7.0 * (n // 4), 4.0) for n in range(_LIFTS)]
    lifts = tuple(
        LiveLift(n + 1, f"column {n + 1}", _ways(crane, pick, place), 120.0, 420.0, frozenset(range(max(0, n - 5))))
        for n, (pick, place) in enumerate(zip(picks, places, strict=True))
    )
    approach_s = np.array(
        [[point_to_point_s(crane, start, pick, _TRAVEL_M) for pick in picks] for start in (places[0], *places)]
    )
    return LiveJob("example", lifts, approach_s, _ground())


def _ways(crane: TowerCrane, pick: CranePose, place: CranePose) -> tuple[Way, ...]:
    high, over = replace(pick, height_m=_TRAVEL_M), replace(place, height_m=_TRAVEL_M)
    straight = [pick, high, over, place]
    inwards = [pick, high, replace(high, radius_m=_INNER_M), replace(over, radius_m=_INNER_M), over, place]
    return tuple(_way(crane, poses) for poses in (straight, inwards))


def _way(crane: TowerCrane, poses: list[CranePose]) -> Way:
    moves = [Move(start, end) for start, end in pairwise(poses)]
    timeline = in_sequence(crane, moves, _PENDULUM)
    time_s = np.linspace(0.0, timeline.duration_s, int(timeline.duration_s / 0.1) + 2)
    boxes = np.repeat([[-0.3, -0.3, 0.3, 0.3]], len(time_s), axis=0)
    return way_of(crane, time_s, timeline.axes_at(time_s), Hanging(np.zeros(len(time_s)), boxes, _PENDULUM))


def _ground() -> Ground:
    draw = np.random.default_rng(1)
    corners = ((12.0, -18.0), (25.0, -18.0), (-10.0, 15.0), (36.0, -5.0), (-20.0, -20.0))
    places_m = np.concatenate([np.array(corner) + draw.uniform(0.0, 14.0, (10, 2)) for corner in corners])
    road_m = np.array([[60.0, 30.0], [35.0, 30.0], [22.0, 30.0]])
    return Ground(places_m, np.arange(len(corners) + 1) * 10, road_m, *NO_TRACK)
