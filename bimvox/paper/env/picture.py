"""The content of a picture of the site, as a value and as text; ``bimvox.paper.rendering`` draws it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.env.spec import Box, PaperSpec, YardPose
from bimvox.paper.env.state import FIRST_COMPONENT, OBSTRUCTION, PaperState, SiteState
from bimvox.site.component import KIND_RGB, STATE_RGB, ConstructionState, IntVec, Rgb


class Look(IntEnum):
    """How a cell looks."""

    AIR = 0
    GROUND = 1
    CONSTRUCTION_AREA = 2
    OBSTRUCTION = 3
    UNBUILT = 4
    IN_TRANSIT = 5
    ARRIVED = 6
    ASSEMBLED = 7


LOOK_RGB: dict[Look, Rgb] = {
    **{look: KIND_RGB[look.name.lower()] for look in (Look.GROUND, Look.CONSTRUCTION_AREA, Look.OBSTRUCTION)},
    **{Look[state.name]: STATE_RGB[state] for state in ConstructionState},
}
"""The paper's colours, from the table of ``bimvox.site.component``."""


@dataclass(frozen=True, slots=True, eq=False)
class SitePicture:
    """A site at one moment.

    Attributes:
        looks: (X, Y, Z) uint8, a ``Look`` each.
        parts: (X, Y, Z) int16 number of the component that fills the cell, from 1; 0 for none.
        starts: Boxes of the initial positions of unassembled components: the orange line boxes.
        targets: Boxes of their targets: the pink wireframes.
        caption: One line about the state.
    """

    looks: NDArray[np.uint8]
    parts: NDArray[np.int16]
    starts: tuple[Box, ...]
    targets: tuple[Box, ...]
    caption: str


def states_of(spec: PaperSpec, state: PaperState, *, just_assembled: bool) -> tuple[ConstructionState, ...]:
    """Return the state of every component, in the order of building.

    A component is assembled in the step in which it arrives. It is shown as arrived after that action, and as assembled
    from the next action on.
    """
    done = state.component
    states = [ConstructionState.ASSEMBLED] * done + [ConstructionState.UNBUILT] * (spec.count - done)
    if state.component < spec.count:
        states[state.component] = ConstructionState.IN_TRANSIT
    if just_assembled and state.component > 0:
        states[state.component - 1] = ConstructionState.ARRIVED
    return tuple(states)


def picture_of_site(
    spec: PaperSpec, site: SiteState, state: PaperState, *, just_assembled: bool = False
) -> SitePicture:
    """Return the picture of a site whose components are in the order of building.

    ``just_assembled`` tells whether the last action assembled a component.
    """
    states = states_of(spec, state, just_assembled=just_assembled)
    looks = np.zeros(spec.shape, np.uint8)
    looks[:, :, 0] = Look.GROUND
    x0, y0, x1, y1 = spec.construction_area
    looks[x0:x1, y0:y1, 0] = Look.CONSTRUCTION_AREA
    looks[site.cells == OBSTRUCTION] = Look.OBSTRUCTION
    parts = np.maximum(site.cells - (FIRST_COMPONENT - 1), 0)
    if state.component < spec.count:
        (a, b, c), (d, e, f) = spec.components[state.component].box_at((state.x, state.y, state.z))
        parts[a:d, b:e, c:f] = state.component + 1
    for i, what in enumerate(states):
        looks[parts == i + 1] = Look[what.name]
    open_parts = range(state.component, spec.count)
    return SitePicture(
        looks,
        parts,
        tuple(YardPose(*_place(site, i)).box(spec.components[i].length_vox) for i in open_parts),
        tuple(spec.components[i].box_at(target_of(site, i)) for i in open_parts),
        _caption_of(spec, site, state),
    )


def _caption_of(spec: PaperSpec, site: SiteState, state: PaperState) -> str:
    """Return one line about a state."""
    step = f"step {state.total} of {spec.steps_allowed}"
    if state.component >= spec.count:
        return f"{step}: all assembled ({spec.count})"
    part = spec.components[state.component]
    late = ", late" if state.steps >= spec.steps_before_late else ""
    return (
        f"{step}: {part.kind} {state.component + 1} of {spec.count} at {(state.x, state.y, state.z)}, target"
        f" {target_of(site, state.component)}{late}"
    )


def target_of(site: SiteState, component: int) -> IntVec:
    """Return the reference cell of a target."""
    x, y, z = (int(n) for n in site.target[component])
    return (x, y, z)


def _place(site: SiteState, component: int) -> tuple[int, int, str]:
    x, y, axis = (int(n) for n in site.stored[component])
    return x, y, "xy"[axis]


_LETTERS: dict[Look, str] = {
    Look.GROUND: ".",
    Look.CONSTRUCTION_AREA: ":",
    Look.OBSTRUCTION: "#",
    Look.UNBUILT: "u",
    Look.IN_TRANSIT: "T",
    Look.ARRIVED: "A",
    Look.ASSEMBLED: "B",
}
_TARGET, _START = "x", "o"


def ansi_picture(picture: SitePicture, *, coloured: bool = True) -> str:
    """Return a caption and a plan with +y upward; the highest object of each column counts.

    ``.`` ground, ``:`` construction area, ``#`` obstruction, ``u`` unbuilt, ``T`` in transit, ``A`` arrived, ``B``
    assembled; on bare ground ``o`` marks an initial position and ``x`` a target.

    Args:
        picture: What to show.
        coloured: Whether escape sequences set colours (24 bit).
    """
    looks = picture.looks
    filled = looks != Look.AIR
    top = looks.shape[2] - 1 - np.argmax(filled[:, :, ::-1], axis=2)
    plan = np.take_along_axis(looks, top[:, :, None], axis=2)[:, :, 0]
    marks = np.full(plan.shape, "", dtype=object)
    for letter, boxes in ((_START, picture.starts), (_TARGET, picture.targets)):
        for (x0, y0, _), (x1, y1, _) in boxes:
            marks[x0:x1, y0:y1] = letter
    rows = [picture.caption]
    for y in range(plan.shape[1] - 1, -1, -1):
        cells = []
        for x in range(plan.shape[0]):
            look = Look(plan[x, y])
            bare = look in (Look.GROUND, Look.CONSTRUCTION_AREA)
            letter = marks[x, y] if bare and marks[x, y] else _LETTERS[look]
            cells.append(_painted(letter, look) if coloured else letter)
        rows.append("".join(cells))
    return "\n".join(rows) + "\n"


def _painted(letter: str, look: Look) -> str:
    ink = LOOK_RGB[Look.ASSEMBLED] if letter == _TARGET else _ink(LOOK_RGB[look])
    ink = LOOK_RGB[Look.UNBUILT] if letter == _START else ink
    r, g, b = LOOK_RGB[look]
    return f"\x1b[48;2;{r};{g};{b}m\x1b[38;2;{ink[0]};{ink[1]};{ink[2]}m{letter}\x1b[0m"


def _ink(paper: Rgb) -> Rgb:
    """Black on light colours, white on dark ones."""
    return (0, 0, 0) if 0.299 * paper[0] + 0.587 * paper[1] + 0.114 * paper[2] > 140.0 else (255, 255, 255)
