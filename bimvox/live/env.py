"""A crane on a site that moves as a Gymnasium environment, ``bimvox/LiveSite-v0``."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from bimvox.env.actions import known_options
from bimvox.live.episode import CHOICES, Episode, Stage
from bimvox.live.example import example_job
from bimvox.live.job import LiveJob
from bimvox.live.picture import live_pixels
from bimvox.live.traffic import DENSITIES, Density, Habits, Sight
from bimvox.live.view import SIZE, decision_of, mask_of, view_of

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
        render_mode: None, ``ansi`` (text) or ``rgb_array`` ((H, W, 3) uint8, ``bimvox.live.picture``).

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
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (SIZE,), np.float32)
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
        return view_of(self._episode), self._info()

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
            episode.decide(decision_of(episode, int(action)))
        earned = (before_s - episode.behind_s) / _SCALE_S
        is_over = episode.stage is Stage.OVER
        return view_of(episode), earned, is_over and not episode.is_cut, episode.is_cut, self._info()

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are candidates, as learners with masks ask for it."""
        return mask_of(self.episode)

    def render(self) -> Any:
        """Return the site from above, or the decision as a line of text, and one line for each candidate."""
        if self.render_mode is None:
            return None
        episode = self.episode
        if self.render_mode == "rgb_array":
            return live_pixels(episode)
        lines = [f"{episode.stage.value} at {episode.time_s:.0f} s, {len(episode.done)} lifts done"]
        if episode.stage is Stage.WAY:
            lines += [f"{n}: way {n + 1} of {episode.lift.name}" for n in episode.candidates]
        elif episode.stage is Stage.LIFT:
            lines += [f"{row}: {self._job.lifts[n].name}" for row, n in enumerate(episode.candidates)]
        return "\n".join([*lines, f"{CHOICES}: wait"]) + "\n"

    def _info(self) -> dict[str, Any]:
        episode = self.episode
        return {
            "action_mask": mask_of(episode),
            "lost_s": episode.lost_s,
            "violations": episode.violations,
            "held_s": episode.held_s,
        }
