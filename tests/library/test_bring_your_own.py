"""``bimvox.plan`` with a planner, an order or a policy of the caller."""

from __future__ import annotations

import dataclasses
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bimvox
from bimvox.library.arguments import code_name
from bimvox.records.lift import Method
from bimvox.revision import revise as revising

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture(scope="module")
def site() -> bimvox.LoadedSite:
    return bimvox.guess_site(bimvox.read(SAMPLES / "frame.ifc"))


@pytest.fixture(scope="module")
def engine(site: bimvox.LoadedSite) -> bimvox.Plan:
    return bimvox.plan(site, policy="greedy")


def over(start: Any, goal: Any, space: bimvox.LiftSpace) -> Any:
    """Up, across and down, if that is free."""
    for top in range(max(start[2], goal[2]), space.shape[2]):
        legs = [start, (*start[:2], top), (*goal[:2], top), goal]
        if all(space.are_free(space.line(a, b)).all() for a, b in pairwise(legs)):
            return legs
    return None


def lies(start: Any, goal: Any, space: bimvox.LiftSpace) -> Any:
    return [start, goal]


def bytes_of(plan: bimvox.Plan, path: Path) -> bytes:
    return bimvox.write_log(plan, path).read_bytes()


def test_a_planner_of_waypoints_plans_and_is_proven_and_a_log_says_who(site: bimvox.LoadedSite, tmp_path: Path):
    plan = bimvox.plan(site, paths=over, policy="greedy")
    name = f"{__name__}:over"
    found = [lift for lift in plan.lifts if lift.lift.method is Method.PLANNER]
    assert len(found) >= 6
    assert {lift.row.method for lift in found} == {name}
    assert plan.figures.methods["planner"] == len(found)
    again = bimvox.read_log(bimvox.write_log(plan, tmp_path / "mine.mcap"))
    assert [lift.row.method for lift in again.lifts] == [lift.row.method for lift in plan.lifts]
    assert bimvox.verify(tmp_path / "mine.mcap").verified
    table = bimvox.export(plan, tmp_path / "mine.json").read_text()
    assert name in table
    # The same planner gives the same log.
    other = bimvox.plan(site, paths=over, policy="greedy", jobs=2)
    assert bytes_of(other, tmp_path / "other.mcap") == (tmp_path / "mine.mcap").read_bytes()


def test_a_planner_that_lies_changes_nothing_but_the_note(site: bimvox.LoadedSite, engine: bimvox.Plan):
    plan = bimvox.plan(site, paths=lies, policy="greedy")
    assert plan.verdict is not None
    assert plan.verdict.verified
    for mine, its in zip(plan.lifts, engine.lifts, strict=True):
        assert mine.row == its.row
        np.testing.assert_array_equal(mine.path_m, its.path_m)
        note = mine.lift.planner_note
        assert note is not None
        assert note.startswith(f"{__name__}:lies: its path is not free")
    assert plan.figures.methods["planner"] == 0
    (remark,) = [one for one in plan.remarks if one.kind == "planner"]
    assert remark.text.startswith("8 lifts were planned without the planner")
    assert "planner" not in engine.figures.methods
    assert not [one for one in engine.remarks if one.kind == "planner"]


def test_a_planner_is_asked_again_for_the_lifts_that_a_change_affects(site: bimvox.LoadedSite):
    plan = bimvox.plan(site, paths=over, policy="none")
    lift = next(one for one in plan.lifts if one.lift.method is Method.PLANNER)
    assert lift.path_m is not None
    at_m = lift.path_m[len(lift.path_m) // 2]
    pole = bimvox.Obstruction("pole", bimvox.Box(tuple(at_m), tuple(at_m + 0.5)))
    revised = bimvox.revise(plan, bimvox.ObstructionSet.of([pole]))
    assert revised.verdict is not None
    assert revised.verdict.verified
    changed = revised.lifts[lift.number - 1]
    assert not np.array_equal(changed.lift.path_vox, lift.lift.path_vox)
    assert changed.lift.method in (Method.PLANNER, Method.SEARCH)
    assert (changed.lift.method is Method.PLANNER) == (changed.lift.planner_note is None)


def test_an_order_is_kept_and_one_that_breaks_support_is_named(site: bimvox.LoadedSite, engine: bimvox.Plan):
    ids = [lift.component.id for lift in engine.lifts]
    columns = [one for one in ids if "Column" in engine.lifts[ids.index(one)].component.ifc_class]
    beams = [one for one in ids if one not in columns]
    order = columns[::-1] + beams[::-1]
    plan = bimvox.plan(site, order=order)
    assert [lift.component.id for lift in plan.lifts] == order
    assert plan.verdict is not None
    assert plan.verdict.verified
    with pytest.raises(bimvox.BimvoxError, match=r"order: Beam .* comes before Column .*, on which it rests"):
        bimvox.plan(site, order=lambda parts: beams + columns)


def test_a_policy_of_the_caller_is_rolled_out_and_named(site: bimvox.LoadedSite):
    plan = bimvox.plan(site, policy=shipped)
    assert plan.policy is not None
    assert plan.policy.id == f"{__name__}:shipped"
    found = [lift for lift in plan.lifts if lift.lift.method is Method.POLICY]
    assert found
    assert {lift.row.method for lift in found} == {f"{__name__}:shipped"}
    assert plan.record.metadata["policy"] == f"{__name__}:shipped"
    wrong = bimvox.plan(site, policy=lambda seen: seen[:, :3])
    assert {lift.lift.method for lift in wrong.lifts} == {Method.SEARCH}
    assert "the policy gave values of shape (1, 3)" in (wrong.lifts[0].lift.planner_note or "")


def shipped(seen: np.ndarray) -> np.ndarray:
    """The shipped network, as a function."""
    from bimvox.policy.generalist.weights import load_generalist

    return load_generalist()(seen)


def test_what_cannot_be_asked_is_refused_at_once(site: bimvox.LoadedSite):
    wrong: dict[str, dict[str, Any]] = {
        "^paths is 5": {"paths": 5},
        "^order is 5": {"order": 5},
        "^order is 'abc'": {"order": "abc"},
        "^policy is 5": {"policy": 5},
        "^paths_limit_s is 0": {"paths_limit_s": 0},
        "^paths_limit_s is nan": {"paths_limit_s": float("nan")},
        "^paths_limit_s is '1'": {"paths_limit_s": "1"},
    }
    for said, options in wrong.items():
        with pytest.raises(bimvox.BimvoxError, match=said) as caught:
            bimvox.plan(site, **options)
        assert caught.value.hint


class _Planner:
    def __call__(self, start: Any, goal: Any, space: bimvox.LiftSpace) -> Any:
        return None

    def ask(self, start: Any, goal: Any, space: bimvox.LiftSpace) -> Any:
        return None


def test_lifts_call_code_by_its_module_and_name():
    assert code_name(over) == f"{__name__}:over"
    assert code_name(partial(partial(over), space=None)) == f"{__name__}:over"
    assert code_name(_Planner()) == f"{__name__}:_Planner"
    assert code_name(_Planner().ask) == f"{__name__}:_Planner.ask"


def test_a_path_that_its_proof_refuses_after_a_change_is_planned_by_the_engine(
    site: bimvox.LoadedSite, monkeypatch: pytest.MonkeyPatch
):
    plan = bimvox.plan(site, paths=over, policy="none")
    lift = next(one for one in plan.lifts if one.lift.method is Method.PLANNER)
    assert lift.path_m is not None
    at_m = lift.path_m[len(lift.path_m) // 2]
    pole = bimvox.Obstruction("pole", bimvox.Box(tuple(at_m), tuple(at_m + 0.5)))
    proves, refused = revising.prove_new, []

    def refusing(made: Any, draft: Any, *others: Any) -> Any:
        """Refuse all paths of the caller's planner, kept ones too."""
        proof = proves(made, draft, *others)
        ids = {one.order: made.site.components[one.component].id for one in made.lifts if one.planner is not None}
        found = {ids[order]: "motion: it swings" for order in draft.paths_to_prove | {lift.lift.order} if order in ids}
        refused.extend(found)
        return dataclasses.replace(proof, refused={**proof.refused, **found}) if found else proof

    monkeypatch.setattr(revising, "prove_new", refusing)
    revised = bimvox.revise(plan, bimvox.ObstructionSet.of([pole]))
    assert refused
    assert revised.verdict is not None
    assert revised.verdict.verified
    for one in revised.lifts:
        if one.component.id in refused:
            assert one.lift.method is Method.SEARCH
            assert one.lift.planner_note == f"{__name__}:over: its path was not proven: motion: it swings"
