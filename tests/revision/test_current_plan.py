"""Which lifts of a plan are done, and which is under way."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from bimvox.revision.current_plan import last_finished, motion_under_way

LIFTS = [SimpleNamespace(order=order) for order in range(5)]


def current(held: int | None = None, **motions: Any) -> Any:
    """Return a plan with motions on the clock, by order, and a load that is held."""
    load = None if held is None else SimpleNamespace(lift=LIFTS[held], motion="of the held load")
    clock = {int(name[1:]): motion for name, motion in motions.items()}
    return SimpleNamespace(held=None if load is None else SimpleNamespace(loads=[load]), on_the_clock=clock)


def motion(start_ns: int, set_ns: int) -> Any:
    return SimpleNamespace(start_ns=start_ns, loaded=SimpleNamespace(time_ns=[0, set_ns - start_ns]))


def test_nothing_is_done_of_a_plan_that_is_not_carried_out() -> None:
    plan = current(_0=motion(0, 5))
    assert last_finished(plan, None) == -1
    assert motion_under_way(plan, LIFTS[0], None) is None


def test_lifts_up_to_the_last_one_set_are_done_and_the_one_that_has_begun_is_under_way() -> None:
    plan = current(_0=motion(0, 5), _2=motion(6, 12), _3=motion(13, 20))
    assert [last_finished(plan, now_ns) for now_ns in (3, 5, 8, 12, 15)] == [-1, 0, 1, 2, 2]
    assert motion_under_way(plan, LIFTS[2], 8) is plan.on_the_clock[2]
    assert motion_under_way(plan, LIFTS[3], 8) is None
    assert motion_under_way(plan, LIFTS[1], 8) is None


def test_everything_before_a_held_load_is_done_also_what_was_skipped() -> None:
    plan = current(2, _0=motion(0, 5))
    assert last_finished(plan, 30) == 1
    assert motion_under_way(plan, LIFTS[2], 30) == "of the held load"
    assert motion_under_way(plan, LIFTS[3], 30) is None
