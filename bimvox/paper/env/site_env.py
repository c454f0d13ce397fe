"""The site as Gymnasium environments, one or many at once; ``bimvox.env.gym`` registers them."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from bimvox.env.actions import ACTION_COUNT, checked_action, known_options, known_render_mode, named
from bimvox.env.dynamics import NO_ACTION
from bimvox.env.problem import distance_field
from bimvox.paper.env.batched import BatchedPaperSite, PaperStep
from bimvox.paper.env.dynamics import (
    PAPER_REWARDS,
    assemble,
    clearance_of,
    is_complete,
    is_late,
    is_truncated,
    move,
    stand_up,
)
from bimvox.paper.env.layout import PaperLayout, draw_layout, layout_of, no_layout, write_layout
from bimvox.paper.env.observation import OBSERVATIONS, observation_space, write_observation
from bimvox.paper.env.picture import SitePicture, ansi_picture, picture_of_site, states_of, target_of
from bimvox.paper.env.spec import PaperSpec, site_named
from bimvox.paper.env.state import PaperState, drawing_of, empty_site, rules_of

_MOST_LAYOUT_OBSTRUCTIONS = 64
"""Room for the obstructions of a layout given to ``reset``."""


class PaperSiteEnv(gymnasium.Env[NDArray[np.float32], np.int64]):
    """Assemble the components of the yard, one after the other, a voxel at a time.

    Actions are those of ``bimvox.env.actions``. Terminated when everything is assembled, truncated when the steps are
    used up. It uses the same functions as :class:`bimvox.paper.env.batched.BatchedPaperSite`.

    ``reset`` takes the option ``layout`` (:class:`PaperLayout`), and no other; by default one is drawn as the site
    says. ``info`` holds ``is_success``, ``bumped``, ``assembled`` (their number), ``component`` (serial number
    in transit; at the end the last one's), ``steps`` (of that component), ``late``, ``cell_vox``, ``target_vox`` and
    ``states`` (of each).

    Args:
        site: The site, or a key of ``PRESETS``; default: the paper's experiment.
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        render_mode: None, ``human``, ``rgb_array`` ((480, 640, 3) uint8) or ``ansi`` (coloured text). ``human`` prints
            every ``reset`` and ``step`` as text.
        **changes: Fields of ``PaperSpec`` that replace those of ``site``.

    Raises:
        ValueError: A name is unknown, or the site is impossible.
    """

    metadata = {"render_modes": ["human", "rgb_array", "ansi"], "render_fps": 4}  # noqa: RUF012  (Gymnasium's own convention)

    def __init__(
        self,
        site: PaperSpec | str = "paper",
        *,
        observation: str = "paper_flat",
        reward: str = "paper",
        render_mode: str | None = None,
        **changes: Any,
    ) -> None:
        self.site_spec = replace(site_named(site), **changes).in_building_order()
        self.render_mode = known_render_mode(render_mode, self.metadata["render_modes"])
        space = observation_space(self.site_spec, observation)
        self.observation_space = cast("gymnasium.Space[NDArray[np.float32]]", space)
        self._shape = space.shape
        self.action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        self._code = OBSERVATIONS[observation].code
        self._scheme = named("reward", reward, PAPER_REWARDS)
        self._rules = rules_of(self.site_spec)
        self._drawing = drawing_of(self.site_spec, room_for=_MOST_LAYOUT_OBSTRUCTIONS)
        self._site = empty_site(self.site_spec, self._drawing, with_field=self._scheme.weights.needs_distance)
        self._state = PaperState(0, 0, 0, 0, NO_ACTION, 0, 0)
        self._just_assembled = False
        self._begun = False

    @property
    def state(self) -> PaperState:
        """The state of the running episode."""
        return self._state

    @property
    def layout(self) -> PaperLayout:
        """The layout of the running episode."""
        return layout_of(self._site)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode; see the class for ``options``.

        Raises:
            ValueError: The layout does not fit the site, or an option is unknown.
            PlanningError: No layout was found.
        """
        super().reset(seed=seed)
        layout = known_options(options, "layout").get("layout")
        if layout is not None:
            write_layout(self.site_spec, layout, self._site)
        else:
            generator = self.np_random.integers(2**64, size=1, dtype=np.uint64)
            if not draw_layout(self._rules, self._drawing, self._site, generator):
                raise no_layout(self.site_spec)
        self._state = stand_up(self._rules, self._site)
        self._just_assembled = False
        self._begun = True
        if self.render_mode == "human":
            self.render()
        return self._observation(), self._info(bumped=False)

    def step(self, action: np.int64) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Take one action; see Gymnasium.

        Raises:
            ActionError: If the action is not an integer from 0 to 5.
            ResetNeeded: Before the first ``reset``.
        """
        if not self._begun:
            raise ResetNeeded("step: no episode has begun; call reset() first")
        moved, earned, bumped, arrived = move(
            self._rules, self._scheme, self._site, self._state, checked_action(action)
        )
        self._state = assemble(self._rules, self._site, moved) if arrived else moved
        self._just_assembled = arrived
        if self.render_mode == "human":
            self.render()
        return (
            self._observation(),
            earned,
            is_complete(self._rules, self._state),
            is_truncated(self._rules, self._state),
            self._info(bumped=bumped),
        )

    def render(self) -> Any:
        """Return the running episode in the form of the render mode; ``human`` prints it and returns None."""
        if self.render_mode == "ansi":
            return ansi_picture(self.picture())
        if self.render_mode == "human":
            coloured = sys.stdout.isatty() and "NO_COLOR" not in os.environ
            sys.stdout.write(ansi_picture(self.picture(), coloured=coloured))
        elif self.render_mode is not None:
            from bimvox.paper.rendering import paper_site_pixels

            return paper_site_pixels(self.picture())
        return None

    def picture(self) -> SitePicture:
        """Return the picture of the running episode."""
        return picture_of_site(self.site_spec, self._site, self._state, just_assembled=self._just_assembled)

    def distance_field(self) -> NDArray[np.int16]:
        """Return (X, Y, Z) int16: the fewest moves of the component in transit to its target from each cell.

        -1 if there is no path. Only the teacher uses it; no observation holds it.
        """
        i = min(self._state.component, self.site_spec.count - 1)
        return distance_field(clearance_of(self._rules, self._site, i), self._site.target[i])

    def _observation(self) -> NDArray[np.float32]:
        out = np.empty(self._shape, np.float32)
        write_observation(self._code, self._rules, self._site, self._state, out.reshape(-1))
        return out

    def _info(self, *, bumped: bool) -> dict[str, Any]:
        state = self._state
        i = min(state.component, self.site_spec.count - 1)
        return {
            "is_success": is_complete(self._rules, state),
            "bumped": bumped,
            "assembled": state.component,
            "component": i + 1,
            "steps": state.steps,
            "late": is_late(self._rules, state),
            "cell_vox": (state.x, state.y, state.z),
            "target_vox": target_of(self._site, i),
            "states": states_of(self.site_spec, state, just_assembled=self._just_assembled),
        }


INFO_KEYS = ("is_success", "bumped", "assembled", "component", "steps", "late")


class PaperVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.int64], NDArray[Any]]):
    """N sites stepped at once. A site whose episode ends begins a new one in the same step (``SAME_STEP``).

    ``infos`` holds an array for each key of ``INFO_KEYS`` and its mask ``_key``. If an episode has ended,
    ``final_obs`` holds its last observation and ``final_info`` its last ``infos``.

    Args:
        num_envs: N.
        site: The site, or a key of ``PRESETS``; default: the paper's experiment.
        observation: A key of ``OBSERVATIONS``.
        reward: A key of ``PAPER_REWARDS``.
        layouts: Episodes are drawn from these. None draws a new layout for each.
        render_mode: None, ``rgb_array`` or ``ansi``: one picture per site.
        copy: Whether ``reset`` and ``step`` return copies. Otherwise they return the environment's own arrays, which
            the step after the next overwrites. Copying the paper's map takes longer than stepping.
        threads: Number of threads. None takes one per core, but fewer for few sites.
        **changes: Fields of ``PaperSpec`` that replace those of ``site``.

    Raises:
        ValueError: A name is unknown, or the site is impossible.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  (Gymnasium's own convention)
        "render_modes": ["rgb_array", "ansi"],
        "render_fps": 4,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    # One parameter per option of gymnasium.make_vec, which passes them by name.
    def __init__(
        self,
        num_envs: int = 1,
        site: PaperSpec | str = "paper",
        *,
        observation: str = "paper_flat",
        reward: str = "paper",
        layouts: Sequence[PaperLayout] | None = None,
        render_mode: str | None = None,
        copy: bool = True,
        threads: int | None = None,
        **changes: Any,
    ) -> None:
        self.batch = BatchedPaperSite(
            replace(site_named(site), **changes),
            num_envs,
            observation=observation,
            reward=reward,
            layouts=layouts,
            threads=threads,
        )
        self.num_envs = num_envs
        self.render_mode = known_render_mode(render_mode, self.metadata["render_modes"])
        self.single_observation_space = self.batch.observation_space
        self.single_action_space = gymnasium.spaces.Discrete(ACTION_COUNT)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._copy = copy
        self._begun = False
        self._everywhere = np.ones(num_envs, np.bool_)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode on every site; a seed determines everything drawn from here on.

        Raises:
            ValueError: There are options; it takes none.
        """
        super().reset(seed=seed)
        known_options(options)
        if seed is not None or self._np_random is None:
            self.batch.seed(int(self.np_random.integers(2**63)))
        observations = self.batch.reset()
        self._begun = True
        nowhere = np.zeros(self.num_envs, np.bool_)
        return self._kept(observations), self._infos(self.batch.states, nowhere, nowhere, self._everywhere)

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Take one action on every site; see Gymnasium.

        Raises:
            ActionError: The actions are not N integers from 0 to 5.
            ResetNeeded: Before the first ``reset``.
        """
        if not self._begun:
            raise ResetNeeded("step: no episode has begun; call reset() first")
        step = self.batch.step(actions)
        ended = step.ended
        late = step.late & ~ended
        infos = self._infos(self.batch.states, step.bumped & ~ended, late, self._everywhere)
        if ended.any():
            infos["final_obs"] = self._final_observations(step, ended)
            infos["_final_obs"] = ended
            infos["final_info"] = self._infos(step.final_states, step.bumped & ended, step.late & ended, ended)
            infos["_final_info"] = ended.copy()
        observations, rewards, terminated, truncated = (
            self._kept(a) for a in (step.observations, step.rewards, step.terminated, step.truncated)
        )
        return observations, rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of every site in the form of the render mode. None without a render mode."""
        pictures = (self.batch.picture(n) for n in range(self.num_envs))
        if self.render_mode is None:
            return None
        if self.render_mode == "ansi":
            return tuple(ansi_picture(picture) for picture in pictures)
        from bimvox.paper.rendering import paper_site_pixels

        return tuple(paper_site_pixels(picture) for picture in pictures)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.batch.close()

    def _kept(self, array: NDArray[Any]) -> NDArray[Any]:
        return array.copy() if self._copy else array

    def _final_observations(self, step: PaperStep, ended: NDArray[np.bool_]) -> NDArray[np.object_]:
        final: NDArray[np.object_] = np.full(self.num_envs, None, dtype=object)
        for n in np.flatnonzero(ended):
            final[n] = self._kept(step.final_observations[n])
        return final

    def _infos(
        self, states: NDArray[np.int64], bumped: NDArray[np.bool_], late: NDArray[np.bool_], where: NDArray[np.bool_]
    ) -> dict[str, Any]:
        assembled = states[:, 0].copy()
        values = (
            assembled >= self.batch.spec.count,
            bumped,
            assembled,
            np.minimum(assembled + 1, self.batch.spec.count),
            states[:, 5].copy(),
            late,
        )
        infos: dict[str, Any] = dict(zip(INFO_KEYS, values, strict=True))
        infos.update({f"_{key}": where.copy() for key in INFO_KEYS})
        return infos
