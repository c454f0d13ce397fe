"""Retraining beside a watch: in a process of its own, so that the next change is answered as fast as ever.

The search's paths stand meanwhile. The training has a budget of environment steps, not of time; the same budget gives
the same policy. A newer change ends it: its lessons would be those of a site that is no more.
"""

from __future__ import annotations

import multiprocessing
import os
import traceback
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING

from bimvox.errors import InputError, PolicyError
from bimvox.policy.choice import PolicyInUse
from bimvox.processes import end_with
from bimvox.progress import SilentProgress

if TYPE_CHECKING:
    from collections.abc import Collection

    from bimvox.planning.assembly import Preparation
    from bimvox.site.site import Site

_NICE = 10
"""The watch goes first."""
_END_S = 5.0


class Retraining:
    """One training at a time.

    Args:
        preparation: What was prepared for the site.
        policy: The policy in use; training begins with it.
        seed: Seed of the training.
        steps: Budget in environment steps.

    Raises:
        InputError: If the system cannot fork a process.
    """

    def __init__(self, preparation: Preparation, policy: PolicyInUse, seed: int, steps: int) -> None:
        if "fork" not in multiprocessing.get_all_start_methods():
            raise InputError("this system cannot retrain beside a watch", hint="leave --retrain out")
        self._preparation, self._policy, self._seed, self._steps = preparation, policy, seed, steps
        self._process: BaseProcess | None = None
        self._answer: Connection | None = None
        self.components: tuple[int, ...] = ()

    def begin(self, site: Site, components: Collection[int]) -> None:
        """Train on a site as it is now, with the lifts of these components among the lessons."""
        self.cancel()
        if self._policy.network is None or not components:
            return
        self.components = tuple(sorted(components))
        context = multiprocessing.get_context("fork")
        self._answer, there = context.Pipe(duplex=False)
        parent = os.getpid()
        arguments = (there, parent, site, self._preparation, self._policy, self.components, self._seed, self._steps)
        self._process = context.Process(target=_train, args=arguments, daemon=True)
        self._process.start()
        there.close()

    @property
    def is_done(self) -> bool:
        """Whether a training has ended and was not asked for its result yet."""
        return self._answer is not None and self._answer.poll()

    def result(self) -> PolicyInUse | None:
        """Return the policy that came of it; None where none was better.

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

    def cancel(self) -> None:
        """End a training that is going on."""
        if self._process is not None:
            self._process.terminate()
            self._process.join(_END_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()
        if self._answer is not None:
            self._answer.close()
        self._process, self._answer = None, None


def _train(
    answer: Connection,
    parent: int,
    site: Site,
    preparation: Preparation,
    policy: PolicyInUse,
    components: tuple[int, ...],
    seed: int,
    steps: int,
) -> None:
    """What the process does."""
    import signal

    from bimvox.policy.choice import retrained

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the whole group; the watch ends this process
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with(parent)
    os.nice(_NICE)
    try:
        found = retrained(
            site, preparation, policy, failed=components, seed=seed, steps=steps, progress=SilentProgress()
        )
    except BaseException as error:
        answer.send("".join(traceback.format_exception_only(error)).strip())
        raise
    answer.send(None if found is policy else found)
