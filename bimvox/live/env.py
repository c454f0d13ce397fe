"""A crane on a site that moves as a Gymnasium environment, ``bimvox/LiveSite-v0``."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import AxisLimits, CranePose, TowerCrane
from bimvox.crane.travel import point_to_point_s
from bimvox.env.actions import known_options
from bimvox.live.deciders import blocked_rows
from bimvox.live.episode import CHOICES, WAIT, Episode, LiveJob, LiveLift, Stage
from bimvox.live.traffic import (
    DENSITIES,
    KIND,
    LORRY,
    NO_TRACK,
    RADIUS,
    STILL_S,
    VX,
    VY,
    Density,
    Ground,
    Habits,
    Sight,
)
from bimvox.live.way import TICK_S, Hanging, Way, seconds_of, way_of
from bimvox.motion.move import Move
from bimvox.motion.swing import Pendulum
from bimvox.motion.timeline import in_sequence

_FEATURES = 12
"""Of a candidate: 1; seconds until its load can be raised; seconds of its way; shares of its way on which somebody is
nearer than 6 m and than 12 m now, and nearer than 6 m at constant velocity; distances of the nearest to pick and place;
their speeds, and how long they have been seen at rest."""
_SIZE = CHOICES * _FEATURES + 6
_NEAR_M, _WIDE_M, _HORIZON = 6.0, 12.0, 30.0


def _view_of(episode: Episode) -> NDArray[np.float32]:
    """Return (_SIZE,) float32 in [-1, 1]: the candidates in order, then stage, waits, progress, and who is there."""
    view = np.zeros(_SIZE)
    for row, candidate in enumerate(episode.candidates):
        view[row * _FEATURES : (row + 1) * _FEATURES] = _features(episode, candidate)
    state = episode.crowd.state
    view[-6:] = (
        1.0 if episode.stage is Stage.WAY else -1.0,
        episode.waited / 10.0,
        len(episode.done) / len(episode.job.lifts),
        len(episode.candidates) / CHOICES,
        float((state[:, KIND] != 1).sum()) / 10.0,
        float((state[:, STILL_S] > 5.0).mean()) if len(state) else 0.0,
    )
    return np.clip(view, -1.0, 1.0).astype(np.float32)


def _mask_of(episode: Episode) -> NDArray[np.bool_]:
    """Return (CHOICES + 1,) which actions are candidates; the last one, to wait, always is."""
    mask = np.zeros(CHOICES + 1, np.bool_)
    mask[: len(episode.candidates)] = True
    mask[CHOICES] = True
    return mask


def _decision_of(episode: Episode, action: int) -> int:
    """Return the decision of an action; an action that is not a candidate waits."""
    candidates = episode.candidates
    return candidates[action] if action < len(candidates) else WAIT


def _features(episode: Episode, candidate: int) -> NDArray[np.float64]:
    if episode.stage is Stage.WAY:
        lift, way = episode.lift, episode.lift.ways[candidate]
    else:
        lift = episode.job.lifts[candidate]
        way = lift.ways[0]
    crowd, rows = episode.crowd, len(way.rests)
    pick, place = _nearest(episode, way, 0), _nearest(episode, way, -1)
    return np.array(
        [
            1.0,
            episode.lead_s(candidate) / 300.0,
            seconds_of(way) / 150.0,
            blocked_rows(way, crowd, _NEAR_M, 0.0) / rows,
            blocked_rows(way, crowd, _WIDE_M, 0.0) / rows,
            blocked_rows(way, crowd, _NEAR_M, _HORIZON / TICK_S) / rows,
            *pick,
            *place,
        ]
    )


def _nearest(episode: Episode, way: Way, row: int) -> tuple[float, float, float]:
    """Return distance, speed and seconds at rest of who is nearest to the hook at an end of a way."""
    state, seen_m = episode.crowd.state, episode.crowd.seen_m
    if not len(state):
        return 1.0, 0.0, 1.0
    away_m = np.hypot(*(seen_m - way.hook_m[row]).T)
    n = int(np.argmin(away_m))
    return away_m[n] / 40.0, float(np.hypot(state[n, VX], state[n, VY])) / 2.0, state[n, STILL_S] / 300.0


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


_GROUND, _WAY, _READY, HOOK, CREW_COLOUR, LORRY_COLOUR, _SEEN = (
    (250, 250, 250),
    (205, 205, 210),
    (120, 170, 225),
    (31, 119, 214),
    (235, 140, 30),
    (150, 60, 60),
    (20, 20, 20),
)
"""Colours: ground, ways of lifts that are left, ways of the candidates, hook, crews, lorries, where they are seen."""
LONGER_EDGE_PX = 480
_MARGIN_M = 5.0
_HOOK_M, _SEEN_M, _WAY_M = 1.0, 0.4, 0.2


def _live_pixels(episode: Episode) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 pixels: x to the right, y up, discs as large as they count."""
    job, state = episode.job, episode.crowd.state
    ways = {n: lift.ways for n, lift in enumerate(job.lifts) if n not in episode.done}
    every = [job.ground.places_m, job.ground.road_m, *(way.hook_m for lift in job.lifts for way in lift.ways)]
    places_m = np.concatenate([*every, job.ground.track[:, 1:]])
    low, high = places_m.min(axis=0) - _MARGIN_M, places_m.max(axis=0) + _MARGIN_M
    scale = LONGER_EDGE_PX / float((high - low).max())
    width, height = (int(np.ceil(edge)) for edge in (high - low) * scale)
    x, y = (np.arange(width) + 0.5) / scale + low[0], high[1] - (np.arange(height) + 0.5) / scale
    pixels = np.full((height, width, 3), _GROUND, np.uint8)

    def disc(at_m: NDArray[np.float64], radius_m: float, colour: tuple[int, int, int]) -> None:
        radius_m = max(radius_m, 1.0 / scale)
        columns, rows = _near(x, at_m[0], radius_m), _near(-y, -at_m[1], radius_m)
        away_m2 = (x[columns] - at_m[0]) ** 2 + (y[rows, None] - at_m[1]) ** 2
        pixels[rows, columns][away_m2 <= radius_m**2] = colour

    now = {episode.hooked} if episode.hooked is not None else set(episode.candidates)
    for n in sorted(ways, key=lambda lift: lift in now):
        for way in ways[n]:
            for at_m in way.hook_m:
                disc(at_m, _WAY_M, _READY if n in now else _WAY)
    for row in state:
        disc(row[:2], float(row[RADIUS]), LORRY_COLOUR if row[KIND] == LORRY else CREW_COLOUR)
    for at_m in episode.crowd.seen_m:
        disc(at_m, _SEEN_M, _SEEN)
    if episode.hooked is not None:
        disc(episode.lift.ways[0].hook_m[0], _HOOK_M, HOOK)
    elif episode.before >= 0:
        disc(job.lifts[episode.before].ways[0].hook_m[-1], _HOOK_M, HOOK)
    return pixels


def _near(middles_m: NDArray[np.float64], at_m: float, radius_m: float) -> slice:
    """Return which ascending pixels may be within a radius along one axis."""
    first, last = np.searchsorted(middles_m, [at_m - radius_m, at_m + radius_m])
    return slice(max(0, int(first) - 1), int(last) + 1)


_SCALE_S = 100.0


class LiveSiteEnv(gymnasium.Env[NDArray[np.float32], np.int64]):
    """Carry out the lifts of a job in traffic; a shield yields, so an action can lose time, never safety.

    An action chooses a candidate: one of the ready lifts, or, once its slings are attached, one of its ways. The last
    action waits for 10 s, and so does an action that is not a candidate; ``info["action_mask"]`` says which ones are.
    The reward is the time lost by a decision, in -100 s. An episode that takes four times as long as without traffic
    is truncated. ``reset`` takes the option ``traffic``, the seed of the traffic; without it the environment draws one.
    ``info`` also holds ``lost_s`` (seconds lost a lift), ``violations`` and ``held_s`` (how long others waited).

    Args:
        job: The lifts; default: an example. ``bimvox.live_job`` makes one from a plan.
        traffic: ``light``, ``medium`` or ``heavy``, or a ``Density``.
        habits: How the others behave.
        sight: How they are seen.
        render_mode: None, ``ansi`` (text) or ``rgb_array`` ((H, W, 3) uint8, ``bimvox.live.env``).

    Raises:
        ValueError: The traffic or the render mode is unknown.
    """

    metadata = {"render_modes": ["ansi", "rgb_array"], "render_fps": 1}  # noqa: RUF012  (Gymnasium's own convention)

    def __init__(
        self,
        job: LiveJob | None = None,
        *,
        traffic: str | Density = "medium",
        habits: Habits = Habits(),  # noqa: B008  (immutable)
        sight: Sight = Sight(),  # noqa: B008  (immutable)
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, "ansi", "rgb_array"):
            raise ValueError(f"render_mode {render_mode!r}: only None, 'ansi' and 'rgb_array' are known")
        if not isinstance(traffic, Density) and traffic not in DENSITIES:
            raise ValueError(f"traffic {traffic!r}: only {', '.join(DENSITIES)} and a Density are known")
        self._job = example_job() if job is None else job
        self._density = traffic if isinstance(traffic, Density) else DENSITIES[traffic]
        self._habits, self._sight = habits, sight
        self.render_mode = render_mode
        self.action_space = gymnasium.spaces.Discrete(CHOICES + 1)
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (_SIZE,), np.float32)
        self._episode: Episode | None = None

    @property
    def episode(self) -> Episode:
        """The running episode.

        Raises:
            ResetNeeded: Before the first ``reset``.
        """
        if self._episode is None:
            raise ResetNeeded("no episode has begun; call reset() first")
        return self._episode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode; see the class for ``options``.

        Raises:
            ValueError: An option is unknown.
        """
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(2**31))
        traffic = int(known_options(options, "traffic").get("traffic", drawn))
        self._episode = Episode(self._job, self._density, traffic, habits=self._habits, sight=self._sight)
        return _view_of(self._episode), self._info()

    def step(self, action: np.int64) -> tuple[NDArray[np.float32], SupportsFloat, bool, bool, dict[str, Any]]:
        """Carry out an action; see Gymnasium.

        Raises:
            ValueError: If the action is not an integer from 0 to 8.
            ResetNeeded: Before the first ``reset``.
        """
        if not self.action_space.contains(action):
            raise ValueError(f"action {action!r}: an integer from 0 to {CHOICES} is needed")
        episode = self.episode
        before_s = episode.behind_s
        if episode.stage is not Stage.OVER:
            episode.decide(_decision_of(episode, int(action)))
        earned = (before_s - episode.behind_s) / _SCALE_S
        is_over = episode.stage is Stage.OVER
        return _view_of(episode), earned, is_over and not episode.is_cut, episode.is_cut, self._info()

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are candidates, as learners with masks ask for it."""
        return _mask_of(self.episode)

    def render(self) -> Any:
        """Return the site from above, or the decision as a line of text, and one line for each candidate."""
        if self.render_mode is None:
            return None
        episode = self.episode
        if self.render_mode == "rgb_array":
            return _live_pixels(episode)
        lines = [f"{episode.stage.value} at {episode.time_s:.0f} s, {len(episode.done)} lifts done"]
        if episode.stage is Stage.WAY:
            lines += [f"{n}: way {n + 1} of {episode.lift.name}" for n in episode.candidates]
        elif episode.stage is Stage.LIFT:
            lines += [f"{row}: {self._job.lifts[n].name}" for row, n in enumerate(episode.candidates)]
        return "\n".join([*lines, f"{CHOICES}: wait"]) + "\n"

    def _info(self) -> dict[str, Any]:
        episode = self.episode
        return {
            "action_mask": _mask_of(episode),
            "lost_s": episode.lost_s,
            "violations": episode.violations,
            "held_s": episode.held_s,
        }
