"""Arguments of the library's functions: refused with one sentence if they are of another kind; policy and processes."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from bimvox.errors import InputError, shown
from bimvox.motion.time_plan import time_plan
from bimvox.planning.external import TIME_LIMIT_S, External, Paths, PathsProposed
from bimvox.planning.given_order import Order
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.planning.rollout import proposer
from bimvox.policy.callables import values_of
from bimvox.processes import processors
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Method
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers

T = TypeVar("T")

HINTS = {
    "plan": "plan(site) and read_log(path) return one",
    "site": "see load_site() and guess_site()",
    "building": "read(path) returns one",
    "plan, a grid or the path of a log": "plan(site) returns a plan, voxelize(building) a grid",
    "site, a plan or the path of a site file": "see load_site() and guess_site()",
    "plan, a site or a grid": "plan(site) and read_log(path) return a plan, voxelize(building) a grid",
}
"""Where to get a value, by its name."""


def insist(verb: str, value: object, kind: type[T] | tuple[type[T], ...], name: str) -> T:
    """Return a value of the kind that a function takes.

    ``kind``: the classes that it takes; ``name``: what to call them, see ``HINTS``.

    Raises:
        InputError: If the value is of another kind.
    """
    if isinstance(value, kind):
        return value
    raise InputError(f"{verb}() takes a {name}, not {_kind(value)}", hint=HINTS[name])


def path_of(verb: str, value: object, what: str = "a file") -> Path:
    """Return the path that a function was given.

    Raises:
        InputError: If it is not a path.
    """
    if isinstance(value, str | PathLike):
        return Path(value)
    raise InputError(f"{verb}() takes the path of {what}, not {_kind(value)}", hint="give a text or a pathlib.Path")


def whole(name: str, value: Any, least: int) -> int | None:
    """Return a whole number, or None if there is none.

    Raises:
        InputError: If it is not a whole number, or below ``least``.
    """
    if value is None:
        return None
    try:
        number = operator.index(value)
    except TypeError:
        raise InputError(f"{name} is {shown(value)}", hint=f"give a whole number from {least}") from None
    if number < least:
        raise InputError(f"{name} is {number}", hint=f"give {least} or more")
    return number


def text(name: str, value: object, hint: str) -> str | None:
    """Return a text, or None if there is none.

    Raises:
        InputError: If it is something else.
    """
    if value is None or isinstance(value, str):
        return value
    raise InputError(f"{name} is {shown(value)}", hint=hint)


def _kind(value: object) -> str:
    name = type(value).__name__
    return "None" if value is None else f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"


@dataclass(frozen=True, slots=True)
class PolicyWish:
    """What proposes paths and order, and how a policy is trained; what is not said, the site file says.

    Attributes:
        policy: Id of a stored policy, ``none``, ``nearest`` or ``default``, or a policy; see :func:`bimvox.plan`.
        seed: Seed of the training.
        steps: Training budget in environment steps; it trains too.
        train: Whether a policy is trained for the site if there is none.
        retrain: If the policy fails lifts, it is trained further on the current site, for at most this many steps.
        paths: A planner, asked before the policy.
        order: The erection sequence, or what makes it.
        paths_limit_s: Longest that a planner or a policy of the caller may take for a lift, seconds.
    """

    policy: str | Any = None
    seed: int | None = None
    steps: int | None = None
    train: bool = False
    retrain: int = 0
    paths: Paths | None = None
    order: Order | None = None
    paths_limit_s: float = TIME_LIMIT_S


def code_name(code: object) -> str:
    """Return what lifts call a function or a model that the caller brought: ``module:name``."""
    while isinstance(code, partial):
        code = code.func
    of = code if hasattr(code, "__qualname__") else type(code)
    module = getattr(of, "__module__", None) or "__main__"
    return f"{module}:{str(of.__qualname__).replace('<locals>.', '')}"


def external_of(wish: PolicyWish, site: Site) -> tuple[External, ...]:
    """Return the planner and the policy that the caller brought, in the order in which they are asked.

    Raises:
        InputError: If one of them cannot be asked, or the time limit is not a positive number.
    """
    limit_s, found = wish.paths_limit_s, []
    if not isinstance(limit_s, int | float) or not 0.0 < limit_s < _MOST_LIMIT_S:
        raise InputError(f"paths_limit_s is {shown(limit_s)}", hint="give seconds, more than 0")
    if wish.paths is not None:
        if not callable(wish.paths):
            raise InputError(
                f"paths is {shown(wish.paths)}", hint="give a function paths(start_vox, goal_vox, space), see LiftSpace"
            )
        planner = PathsProposed(wish.paths, site.frame)
        found.append(External(code_name(wish.paths), planner, Method.PLANNER, limit_s))
    if not (wish.policy is None or isinstance(wish.policy, str)):
        found.append(External(code_name(wish.policy), proposer(values_of(wish.policy)), Method.POLICY, limit_s))
    return tuple(found)


_MOST_LIMIT_S = 1e6

_FEW_PARTS, _FEW_SHARED = 100, 50
"""So few are planned before a worker has started, by one crane or by several, whose legs and distances take longer."""


@contextmanager
def workers_of(site: Site, jobs: int | None) -> Iterator[Workers]:
    """Start the processes that share the work on a site, and end them after the block.

    ``jobs``: number of processes, this one included; None: one per processor.
    """
    wanted = processors() if jobs is None else jobs
    few = _FEW_SHARED if site.has_several_cranes else _FEW_PARTS
    if wanted == 1 or len(site.components) < few:
        yield ALONE
        return
    workers = Workers(wanted, (plan_lifts, verify_plan, time_plan, verify_motions))
    try:
        yield workers
    finally:
        workers.close()


def constants_of(site: Site, preparation: Preparation | None = None) -> list[object]:
    """Return what does not change while a site is planned, proven or revised: what is sent to a worker once."""
    prepared = [] if preparation is None else [*filter(None, preparation.places), preparation]
    return [*site.components, *site.blockers, site.frame, *prepared, site]
