"""Retraining during a watch, in a separate process, so that it does not delay the next change.

Meanwhile the paths found by search are used. The budget is in environment steps, not in time: the same budget gives the
same policy. A newer change stops the training, because its lessons would be those of a site that has been replaced. The
process is spawned, not forked, so it works the same on every system.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import traceback
from collections.abc import Callable, Collection
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from bimvox.errors import PolicyError
from bimvox.planning.preparation import Preparation
from bimvox.policy.choice import PolicyInUse, retrained
from bimvox.processes import end_with
from bimvox.progress import SilentProgress
from bimvox.site.site import Site
from bimvox.undisturbed import undisturbed

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
