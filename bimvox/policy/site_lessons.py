"""Training lifts of a site's policy: the site's own lifts, at stages spread over its assembly."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.env.problem import LiftProblem, is_learnable, training_problem
from bimvox.planning.assembly import Assembly
from bimvox.planning.preparation import Preparation
from bimvox.planning.search import which_free
from bimvox.planning.stage import Stage
from bimvox.policy.generalist.problems import with_boxes
from bimvox.progress import Progress
from bimvox.site.site import Site

_PROBLEMS = 20
_PROBLEM_BYTES = 600_000_000  # tables and distance fields of all training problems together
_BYTES_A_CELL = 6  # int32 table, int16 distance
_STARTS = 256
_MOST_BOXES = 6


def training_problems(
    site: Site,
    preparation: Preparation,
    seed: int,
    progress: Progress,
    *,
    with_obstructions: bool = False,
    surely: Collection[int] = (),
) -> list[LiftProblem]:
    """Return lifts to learn from, spread evenly over the order, each with starts all over the yard.

    The site's own obstructions are left out, because the policy's key is its geometry; random boxes obstruct half of
    the lifts instead.

    Args:
        site: The site.
        preparation: Its contacts, order and yard.
        seed: Chooses the starts and the boxes.
        progress: Receives the stage.
        with_obstructions: Whether to keep the site's own obstructions, and add no others.
        surely: Components whose lifts must be among them, as far as memory allows.
    """
    clear = (
        site
        if with_obstructions
        else replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
    )
    order = preparation.sequence.order
    most = max(2, _PROBLEM_BYTES // (_BYTES_A_CELL * int(np.prod(site.shape))))
    first = [number for number, index in enumerate(order) if index in surely][:most]
    rest = np.linspace(0, len(order) - 1, min(len(order), max(0, most - len(first)), _PROBLEMS)).round().astype(int)
    chosen = {*first, *rest.tolist()}
    rng = np.random.default_rng(seed)
    assembly = Assembly(clear, preparation)
    problems: list[LiftProblem] = []
    progress.stage("lessons", len(order))
    for number, index in enumerate(order):
        if number in chosen:
            found = _lesson(clear, assembly, index, rng)
            if found is not None:
                stage, starts, lift = found
                gate = stage.insertion.gate_vox
                if index in surely:
                    lift = replace(lift, starts_vox=_own_start_first(lift))
                if len(problems) % 2 and not with_obstructions:
                    boxed = with_boxes(rng, stage.space, int(rng.integers(1, _MOST_BOXES + 1)))
                    other = training_problem(boxed, stage.start_vox, gate, starts)
                    lift = other if is_learnable(other) else lift
                problems.append(lift)
        else:
            assembly.skip(index)
        assembly.finish(index, placed=preparation.places[index] is not None)
        progress.advance()
    return problems


def _lesson(
    site: Site, assembly: Assembly, index: int, rng: np.random.Generator
) -> tuple[Stage, NDArray[np.int32], LiftProblem] | None:
    """Return a lift with the largest clearance that leaves a path, and starts for it; None if it cannot be lifted."""
    result = None
    for stage in assembly.each_clearance(index):
        if isinstance(stage, Stage):
            starts = _starts(site, stage, rng)
            lift = training_problem(stage.space, stage.start_vox, stage.insertion.gate_vox, starts)
            result = (stage, starts, lift)
            if is_learnable(lift):
                break
    return result


def _starts(site: Site, stage: Stage, rng: np.random.Generator) -> NDArray[np.int32]:
    """Return (N, 3) cells all over the yard: where transits start, or above that, where they have their clearance."""
    columns = np.argwhere(site.yard)
    if len(columns) > _STARTS:
        columns = columns[np.sort(rng.choice(len(columns), _STARTS, replace=False))]
    heights = np.arange(stage.start_vox[2], site.shape[2])
    above = np.concatenate(
        [np.repeat(columns, len(heights), axis=0), np.tile(heights, len(columns))[:, None]], axis=1
    ).astype(np.int32)
    free = which_free(stage.space, above).reshape(len(columns), len(heights))
    first = np.where(free.any(axis=1), free.argmax(axis=1), 0)
    starts: NDArray[np.int32] = above.reshape(len(columns), len(heights), 3)[np.arange(len(columns)), first]
    return starts


def _own_start_first(lift: LiftProblem) -> NDArray[np.int32]:
    """Return the starts with the lift's own first, if it is among them: every test includes the first start."""
    own = (lift.starts_vox == np.array(lift.start_vox)).all(axis=1)
    return np.concatenate([lift.starts_vox[own], lift.starts_vox[~own]])
