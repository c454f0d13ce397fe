"""The paper's observations by name: their spaces, and one kernel that writes any of them."""

from __future__ import annotations

from typing import NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.env.actions import named
from bimvox.paper.env.dynamics import clearance_of
from bimvox.paper.env.paper_map import CHANNELS, write_map
from bimvox.paper.env.pyramid import OBSERVATION_SIZE, observe
from bimvox.paper.env.rules import SpecArrays
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.env.state import PaperState, SiteState, lift_state
from bimvox.paper.env.window import WINDOW_OBSERVATION_SIZE, write_window

PAPER_MAP, EGOCENTRIC, WINDOW = range(3)


class Observation(NamedTuple):
    """The kernel that writes an observation, and whether the paper's map is returned as a vector."""

    code: int
    flat: bool = True


OBSERVATIONS: dict[str, Observation] = {
    "paper": Observation(PAPER_MAP, flat=False),
    "paper_flat": Observation(PAPER_MAP),
    "egocentric": Observation(EGOCENTRIC),
    "window": Observation(WINDOW),
}
"""``paper``: the paper's map, (X, Y, 6). ``paper_flat``: the same numbers as a vector, C order; stable-baselines3 takes
every three-dimensional box for an image. ``egocentric``: the pyramid of ``bimvox.paper.env.pyramid`` around the
component in transit. ``window``: ``bimvox.paper.env.window``."""


def observation_space(spec: PaperSpec, name: str) -> gymnasium.spaces.Box:
    """Return the space of an observation.

    Bounds of the paper's channels: heights 0 .. Z - 1, flag and arrived 0 .. 1, count 0 .. n. The others lie in
    [-1, 1].

    Raises:
        ValueError: There is no observation of that name.
    """
    observation = named("observation", name, OBSERVATIONS)
    if observation.code != PAPER_MAP:
        size = OBSERVATION_SIZE if observation.code == EGOCENTRIC else WINDOW_OBSERVATION_SIZE
        return gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float32)
    nx, ny, nz = spec.shape
    top = nz - 1
    high = np.broadcast_to(np.array([top, 1, top, top, 1, spec.count], np.float32), (nx, ny, CHANNELS))
    high = np.ascontiguousarray(high.reshape(-1) if observation.flat else high)
    return gymnasium.spaces.Box(np.zeros_like(high), high, dtype=np.float32)


@kernel
def write_observation(
    code: int, rules: SpecArrays, site: SiteState, state: PaperState, out: NDArray[np.float32]
) -> None:
    """Write the observation of a code into ``out``, (size,) float32, contiguous."""
    if code == PAPER_MAP:
        nx, ny, _ = site.cells.shape
        write_map(rules, site, state, out.reshape((nx, ny, CHANNELS)))
    elif code == EGOCENTRIC:
        i = min(state.component, rules.boxes.shape[0] - 1)
        observe(clearance_of(rules, site, i), site.target[i], lift_state(state), out)
    else:
        write_window(rules, site, state, out)
