"""Retraining during a watch, in a separate process, so that it does not delay the next change.

Meanwhile the paths found by search are used. The budget is in environment steps, not in time: the same budget gives the
same policy. A newer change stops the training, because its lessons would be those of a site that has been replaced. The
process is spawned, not forked, so it works the same on every system.
"""

from __future__ import annotations

import io
import multiprocessing
import os
import signal
import sys
import traceback
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from bimvox.errors import PolicyError
from bimvox.library.site import rasterise
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from bimvox.motion.time_plan import KnownLegs, MotionMaking
from bimvox.motion.trajectories import chained
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import Propose
from bimvox.policy.choice import PolicyInUse, retrained
from bimvox.processes import end_with
from bimvox.progress import SilentProgress
from bimvox.proof.bodies.solid import solid_of
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.revision.current_plan import CurrentPlan, RevisionPart, RevisionRequest
from bimvox.revision.revise import revise
from bimvox.site.build import with_obstructions
from bimvox.site.obstructions.obstruction_set import Obstruction, ObstructionSet, Voxels
from bimvox.site.site import Site
from bimvox.undisturbed import undisturbed
from bimvox.walk import Store
from bimvox.workers import Workers

_NICE = 10
"""Lower priority than the watch."""
_END_S = 5.0


class Retraining:
    """One training at a time.

    Args:
        preparation: Contacts, order and yard of the site.
        policy: The policy in use; training starts from it.
        seed: Seed of the training.
        steps: Budget in environment steps.

    Attributes:
        train: The function that trains; it is pickled with its arguments.
        components: The components whose failed lifts are trained.
    """

    def __init__(self, preparation: Preparation, policy: PolicyInUse, seed: int, steps: int) -> None:
        self._preparation, self._policy, self._seed, self._steps = preparation, policy, seed, steps
        self._process: BaseProcess | None = None
        self._answer: Connection | None = None
        self.train: Callable[..., PolicyInUse] = retrained
        self.components: tuple[int, ...] = ()

    @undisturbed()
    def begin(self, site: Site, components: Collection[int]) -> None:
        """Train on the current site, with the lifts of these components among the lessons."""
        self.cancel()
        if self._policy.propose is None or not components:
            return
        self.components = tuple(sorted(components))
        context = multiprocessing.get_context("spawn")
        self._answer, there = context.Pipe(duplex=False)  # type: ignore[assignment,unused-ignore]  # as on Windows
        task = partial(
            self.train,
            site,
            self._preparation,
            self._policy,
            failed=self.components,
            seed=self._seed,
            steps=self._steps,
        )
        self._process = context.Process(target=_train, args=(there, os.getpid(), task, self._policy.id), daemon=True)
        self._process.start()
        there.close()

    @property
    def is_done(self) -> bool:
        """Whether a training has ended and its result has not been read yet."""
        return self._answer is not None and self._answer.poll()

    def result(self) -> PolicyInUse | None:
        """Return the new policy; None if none was better.

        Raises:
            PolicyError: If the training failed.
        """
        assert self._answer is not None
        try:
            found = self._answer.recv()
        except EOFError:
            found = "its process ended"
        self.cancel()
        if isinstance(found, str):
            raise PolicyError(f"retraining failed: {found}")
        return found if isinstance(found, PolicyInUse) else None

    @undisturbed()
    def cancel(self) -> None:
        """Stop a running training."""
        if self._process is not None:
            self._process.terminate()
            self._process.join(_END_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()
        if self._answer is not None:
            self._answer.close()
        self._process, self._answer = None, None


def _train(answer: Connection, parent: int, task: Callable[..., PolicyInUse], before: str) -> None:
    """Train, and answer with the new policy, None if it is the old one, or an error message."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the watch ends this process
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with(parent)
    if sys.platform != "win32":
        os.nice(_NICE)
    try:
        found = task(progress=SilentProgress())
    except BaseException as error:
        answer.send("".join(traceback.format_exception_only(error)).strip())
        raise
    answer.send(None if found.id == before else found)


# A warm-up revision, so that the first real one is as quick as the others.
#
# The first revision loads compiled code and builds schemas, which takes more than a second. The warm-up does that
# before the watch reports that it is ready.

_TRIES, _WARM_LIFTS = 3, 24


def warm_up(
    current: CurrentPlan,
    preparation: Preparation,
    propose: Propose | None,
    known_shapes: set[int],
    record_of: Callable[[RevisionPart, dict[str, bytes], dict[str, str]], PlanLog],
) -> None:
    """Revise for an obstruction of one cell on some lifts' paths, write to memory, and discard the result.

    Args:
        current: The current plan; it is not changed.
        preparation: Contacts, order and yard of its site.
        propose: The policy; None for search alone.
        known_shapes: See ``verify_plan``.
        record_of: Makes the record of a part: part, files, event.
    """
    planned = [lift for lift in current.plan.lifts if lift.path_vox is not None]
    if not planned or current.pending:
        return
    for component in current.plan.site.components:  # a plan from disk has not been proven in this process
        solid_of(component.mesh, current.plan.site.rules.contact_tolerance_m)
    for n in range(_TRIES):
        lift = planned[n * (len(planned) - 1) // max(1, _TRIES - 1)]
        assert lift.path_vox is not None
        site = _with_cell(current.plan.site, lift.path_vox[len(lift.path_vox) // 2].tolist())
        part = next(
            revise(current, RevisionRequest(site, preparation, propose=propose, first=1), known_shapes=known_shapes)
        )
        write_log(io.BytesIO(), record_of(part, {}, {}))


def warm_workers(plan: LiftPlan, preparation: Preparation, workers: Workers) -> None:
    """Have every process time, prove and write some lifts: it loads its code, and builds what is built once."""
    orders = [lift.order for lift in plan.lifts if lift.status is Status.PLANNED][:_WARM_LIFTS]
    if workers.count == 1 or not orders or not plan.site.cranes:
        return
    few = replace(plan, lifts=tuple(lift for lift in plan.lifts if lift.order in orders))
    others = tuple(lift for lift in plan.lifts if lift.order not in orders)
    making = MotionMaking(plan.site, preparation, plan.lifts)
    found = making.results([KnownLegs(order) for order in orders], Store(), workers)
    motions = chained([motion for motion in found if isinstance(motion, LiftMotion)])
    verify_plan(few, others, workers=workers)
    verify_motions(few, motions, others, workers=workers)
    write_log(io.BytesIO(), PlanLog(few, motions, context=others), workers=workers)


def _with_cell(site: Site, cell: list[int]) -> Site:
    """Return the site with one more obstruction, of one cell."""
    x, y, z = cell
    there = tuple(b for b in site.blockers if b.kind == "obstruction")
    one = with_obstructions(site, ObstructionSet.of([Obstruction("warm-up", Voxels(((x, y, z),)))]), rasterise)
    return replace(one, blockers=(*one.blockers, *there))
