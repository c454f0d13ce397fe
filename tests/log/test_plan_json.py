from __future__ import annotations

import json
from typing import Any

import pytest
from log_building import same, tiny_plan

from bimvox.errors import LogFileError
from bimvox.log.plan_json import plan_from_json, plan_to_json
from bimvox.records.lift import LiftPlan


def paths_of(plan: LiftPlan) -> dict[int, Any]:
    return {lift.order: lift.path_vox for lift in plan.lifts if lift.path_vox is not None}


def test_a_plan_comes_back_exactly() -> None:
    plan = tiny_plan()
    back, context = plan_from_json(plan_to_json(plan), plan.site, paths_of(plan), "log")
    assert context == ()
    same(back, plan)


def test_an_extract_keeps_the_other_lifts_as_context() -> None:
    plan = tiny_plan()
    part = LiftPlan(plan.site, plan.lifts[2:], plan.clashes, plan.notes)
    back, context = plan_from_json(plan_to_json(part, plan.lifts[:2]), plan.site, paths_of(part), "log")
    same(back, part)
    assert [(lift.order, lift.status, lift.path_vox) for lift in context] == [
        (0, "planned", None),
        (1, "infeasible", None),
    ]
    assert context[0].place is not None


def test_a_recovered_log_may_lack_paths() -> None:
    plan = tiny_plan()
    paths = paths_of(plan)
    del paths[2]
    back, context = plan_from_json(plan_to_json(plan), plan.site, paths, "log", partial=True)
    assert [lift.order for lift in back.lifts] == [0, 1]
    assert [lift.order for lift in context] == [2]


def test_the_json_is_readable_by_others() -> None:
    document = json.loads(plan_to_json(tiny_plan()))
    column = document["lifts"][0]
    assert column["id"] == column["global_id"] == "0GlobalIdColumnA"
    assert (column["order"], column["method"], column["moves"], column["shortest_moves"]) == (0, "policy", 17, 15)
    assert column["place"] == {"delivery": 0, "pose": "lying_x", "cell_vox": [0, 0, 1]}
    assert document["lifts"][1]["blocked_by"] == ["truck-7"]
    assert [clash["way_out_m"] for clash in document["clashes"]] == [[0.0, 0.0, -0.1 / 3.0], None]


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        ("component", 9, "no component 9"),
        ("component", 1, "but component 1 is"),
        ("status", "done", "not one of planned, infeasible"),
        ("moves", 3, "3 moves, but its path has 17"),
        ("place", {"pose": "lying_x", "delivery": "x", "cell_vox": [0, 0, 0]}, "'x' is not int"),
        ("place", {"pose": "lying_x", "delivery": 2**70, "cell_vox": [0, 0, 0]}, "more than 64 bits"),
        ("carried", None, "not a lift"),
        ("surprise", 1, "unknown key 'surprise'"),
        ("order", -1, "order"),
    ],
)
def test_a_plan_that_contradicts_itself_is_an_error(where: str, value: object, message: str) -> None:
    plan = tiny_plan()
    document = json.loads(plan_to_json(plan))
    document["lifts"][0][where] = value
    with pytest.raises(LogFileError, match=message):
        plan_from_json(json.dumps(document).encode(), plan.site, paths_of(plan), "log")


@pytest.mark.parametrize(
    "data", [b"", b"{", b"[]", b"null", b'{"version": 2}', b'{"version": 1}', b"\xff\xfe", b"[" * 100_000]
)
def test_garbage_is_an_error(data: bytes) -> None:
    with pytest.raises(LogFileError, match="plan in it cannot be read"):
        plan_from_json(data, tiny_plan().site, {}, "log")


def test_a_missing_path_is_an_error() -> None:
    plan = tiny_plan()
    with pytest.raises(LogFileError, match="its path is not in the log"):
        plan_from_json(plan_to_json(plan), plan.site, {}, "log")
