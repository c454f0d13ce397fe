"""A lift keeps its distance while its part is upended and turned, straight up from the yard, and on its last moves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.planning.beside import column_of
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.remarks.remarks import remarks_of
from bimvox.remarks.table import RAISED_NEAR, SMALL_APPROACH, SMALL_DEPARTURE
from bimvox.site.collision import CLEARANCES
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.site import Rules, Site

PART = (2.0, 2.0, 0.0), (3.0, 3.0, 1.0)


def asked(rule: str, metres: float = 1.0, *, hard: bool = False) -> Rules:
    return Rules(rope=False, transit_clearance_m=1.0, gives_way=() if hard else (rule,), **{rule: metres})


def beside_its_place(low_m: float, high_m: float, rules: Rules) -> Site:
    """A part that is set half a metre from a long wall on either side, which begin and end at these heights."""
    posts = [("west", (1.0, 0.0, low_m), (1.5, 9.0, high_m)), ("east", (3.5, 0.0, low_m), (4.0, 9.0, high_m))]
    return box_site([("a", *PART)], structure=posts, rules=rules)


def beside_the_yard(low_m: float, high_m: float, rules: Rules) -> Site:
    """A part that lies half a metre from a post."""
    post = [("post", (12.5, 2.0, low_m), (13.0, 4.0, high_m))]
    return box_site([("a", *PART, {"start_vox": (22, 5, 1)})], structure=post, rules=rules)


def upended_beside_a_wall(away_m: float, rules: Rules, *, is_obstruction: bool = False, waits: bool = False) -> Site:
    """A column of 4 m that is upended next to a wall, an obstruction or a part that waits for its lift."""
    column = ("column", (1.0, 1.0, 0.0), (1.5, 1.5, 4.0), {"erected": True, "start_vox": (24, 10, 1)})
    north_m = 5.0 + 0.5 + away_m
    wall = ("wall", (12.0, north_m, 0.0), (16.0, north_m + 0.5, 2.0))
    parts = [column]
    if waits:
        parts.append(("later", (6.0, 6.0, 0.0), (8.0, 6.5, 1.0), {"start_vox": (24, int(2 * north_m), 1)}))
        return box_site(parts, rules=rules)
    key = "obstructions" if is_obstruction else "structure"
    return box_site(parts, rules=rules, **{key: [wall]})


def turned_above_a_wall(rules: Rules) -> Site:
    """A beam that is turned in the yard above a wall of 1 m."""
    beam = ("beam", (1.0, 2.0, 0.0), (5.0, 2.5, 0.5), {"start_vox": (28, 8, 1), "stored_turn": 1})
    return box_site([beam], structure=[("wall", (15.5, 3.0, 0.0), (16.0, 9.0, 1.0))], rules=rules, shape=(50, 30, 20))


def planned(site: Site) -> tuple[LiftPlan, Lift]:
    plan = plan_lifts(site, prepare(site))
    return plan, plan.lifts[0]


def failed(plan: LiftPlan, **lift: float | None) -> dict[str, list[str]]:
    """Return the failures of a proof by check, of a plan whose first lift is changed."""
    forged = dataclasses.replace(plan, lifts=(dataclasses.replace(plan.lifts[0], **lift), *plan.lifts[1:]))
    return {check.name: list(check.failures) for check in verify_plan(forged).checks if not check.passed}


@pytest.mark.parametrize(
    ("where", "rule", "field", "site"),
    [
        ("on its last moves", "approach_clearance_m", SMALL_APPROACH, lambda rules: beside_its_place(0.0, 5.0, rules)),
        ("straight up", "departure_clearance_m", SMALL_DEPARTURE, lambda rules: beside_the_yard(0.0, 5.0, rules)),
        ("upended", "upending_clearance_m", RAISED_NEAR, lambda rules: upended_beside_a_wall(0.5, rules)),
        (
            "upended",
            "upending_clearance_m",
            RAISED_NEAR,
            lambda rules: upended_beside_a_wall(0.5, rules, is_obstruction=True),
        ),
        ("upended", "upending_clearance_m", RAISED_NEAR, lambda rules: upended_beside_a_wall(0.5, rules, waits=True)),
    ],
)
def test_a_clearance_that_cannot_be_kept_gives_way_alone_and_as_little_as_it_must(where, rule, field, site) -> None:
    plan, lift = planned(site(asked(rule, 1.5)))
    assert lift.status is Status.PLANNED
    assert lift.kept == ALL_KEPT._replace(**{rule: 0.5})
    assert not failed(plan)
    # A forger who says that the lift keeps all of it, or more than it does, is refused by name.
    for forged_m in (None, 1.0):
        ((name, (said,)),) = failed(plan, **{rule: forged_m}).items()
        assert name in ("rest_margin", "yard_margin")
        assert where in said
        assert rule in said
    _, lift = planned(site(asked(rule, 1.5, hard=True)))
    assert lift.status is Status.INFEASIBLE
    assert where in (lift.reason or "")
    assert f"[rules] {rule}" in (lift.reason or "")
    assert lift.blocked_by


def test_what_is_no_more_than_a_metre_higher_than_a_part_at_rest_does_not_count() -> None:
    for site in (
        beside_its_place(0.0, 2.0, asked("approach_clearance_m")),
        beside_the_yard(0.0, 2.0, asked("departure_clearance_m")),
        upended_beside_a_wall(1.0, asked("upending_clearance_m")),
    ):
        plan, lift = planned(site)
        assert (lift.status, lift.kept) == (Status.PLANNED, ALL_KEPT)
        assert not failed(plan)


def test_last_moves_go_round_what_is_beside_the_shortest_ones() -> None:
    """One post: the part comes down a metre away from it, and goes to its place below the post's height."""
    post = [("post", (3.5, 1.0, 1.5), (4.0, 4.0, 5.0))]
    site = box_site([("a", *PART)], structure=post, rules=asked("approach_clearance_m"))
    plan, lift = planned(site)
    assert (lift.status, lift.kept) == (Status.PLANNED, ALL_KEPT)
    assert not failed(plan)
    straight, _ = planned(dataclasses.replace(site, rules=Rules(rope=False, transit_clearance_m=1.0)))
    assert "rest_margin" in failed(dataclasses.replace(straight, site=site))


def test_a_turned_part_says_what_it_keeps_above_what_it_turns_over() -> None:
    rule = "turning_clearance_m"
    plan, lift = planned(turned_above_a_wall(asked(rule)))
    assert lift.place is not None
    assert (lift.status, lift.place.turn, lift.kept) == (Status.PLANNED, 1, ALL_KEPT)
    assert not failed(plan)
    place = dataclasses.replace(lift.place, rise_vox=lift.place.rise_vox - 1)
    path_vox = np.concatenate([[place.transit_start_vox], lift.path_vox]).astype(np.int32)
    assert "yard_margin" in failed(plan, place=place, path_vox=path_vox)
    # It says so: it is accepted, with a claim.
    assert not failed(plan, place=place, path_vox=path_vox, turning_clearance_m=0.5)


def test_remarks_name_what_is_too_near() -> None:
    plan, _ = planned(upended_beside_a_wall(0.5, asked("upending_clearance_m")))
    crane_only = [one for one in remarks_of(plan, ()) if one.kind == RAISED_NEAR.code]
    assert not crane_only  # remarks about clearances are of sites with a crane


def test_a_load_beyond_the_window_that_is_looked_at_is_not_free() -> None:
    site = beside_its_place(0.0, 5.0, asked("approach_clearance_m"))
    counts = np.zeros(site.shape, np.uint16)
    rest = site.components[0].shape.cells + np.array(site.components[0].target_vox, np.int32)
    column = column_of(site, counts, rest, 1, 2)
    places = np.array([site.components[0].target_vox, (30, 20, 3)], np.int32)
    assert column.which_free(site.components[0].shape.boxes, places, 1).tolist() == [True, False]
    assert Kept() == ALL_KEPT


def scattered(seed: int) -> Site:
    """Return four parts, structure and obstructions at random places, with clearances most of which give way."""
    draw = np.random.default_rng(seed)

    def metres(low: int, high: int) -> float:
        return 0.5 * float(draw.integers(low, high))

    parts: list[tuple] = []
    for n in range(4):
        x, y = 2.0 + 3.0 * (n % 2) + metres(0, 2), 2.0 + 3.5 * (n // 2) + metres(0, 2)
        if draw.random() < 0.5:
            parts.append((f"column {n}", (x, y, 0.0), (x + 0.5, y + 0.5, metres(3, 8)), {"erected": True}))
        else:
            turned = {"stored_turn": 1} if draw.random() < 0.5 else {}
            parts.append((f"part {n}", (x, y, 0.0), (x + metres(1, 5), y + metres(1, 3), metres(1, 4)), turned))
    boxes = []
    for n in range(5):
        low = metres(0 if n < 3 else 20, 36), metres(0, 26), metres(0, 4)
        boxes.append((f"box {n}", low, tuple(side + metres(1, 6) for side in low)))
    crane = test_crane(base=(12.0, -3.0, 0.0), jib=40.0, height=16.0) if draw.random() < 0.6 else None
    given = {rule: metres(0, 4) for rule in CLEARANCES}
    rules = Rules(rope=crane is not None, gives_way=tuple(one for one in given if draw.random() < 0.8), **given)
    yard = ((20 + int(draw.integers(0, 12)), 0), (40, 30))
    return box_site(
        parts, structure=boxes[:3], obstructions=boxes[3:], crane=crane, shape=(40, 30, 28), yard=yard, rules=rules
    )


def test_what_is_measured_is_proven_and_nothing_more() -> None:
    """Wherever things are, the proof accepts what lifts keep, and no more than that while they are upended and set."""
    looked_at = set()
    for seed in range(150, 190):
        site = scattered(seed)
        plan = plan_lifts(site, prepare(site))
        assert all("nothing was proven" in failure for failure in verify_plan(plan).failures), seed
        for n, lift in enumerate(plan.lifts):
            for rule in ("approach_clearance_m", "upending_clearance_m", "turning_clearance_m"):
                kept_m = getattr(lift.kept, rule)
                if kept_m is not None:
                    more_m = kept_m + 0.5 if kept_m + 0.5 < getattr(site.rules, rule) else None
                    forged = lift.keeping(lift.kept._replace(**{rule: more_m}))
                    other = dataclasses.replace(plan, lifts=(*plan.lifts[:n], forged, *plan.lifts[n + 1 :]))
                    assert any(rule in failure for failure in verify_plan(other).failures), (seed, rule)
                    looked_at.add(rule)
    assert len(looked_at) == 3
