import pytest
from box_sites import PORTAL, box_site
from moving_sites import row

from bimvox.errors import InputError
from bimvox.library.hand_over import as_ordered, may_go_to_others
from bimvox.library.sequences.suite import sequence_problems
from bimvox.planning.given_order import prepare_in_order
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.site import Rules


@pytest.fixture(scope="module")
def site():
    return box_site(PORTAL, rules=Rules(rope=False))


def ids(site, order):
    return [site.components[index].id for index in order]


@pytest.mark.parametrize("order", [["right", "left", "beam", "slab"], ["left", "right", "beam", "slab"]])
def test_the_order_of_the_caller_is_kept_and_proven(site, order):
    _, preparation = prepare_in_order(site, order)
    assert ids(site, preparation.sequence.order) == order
    assert all(preparation.places)
    plan = plan_lifts(site, preparation)
    assert ids(site, [lift.component for lift in plan.lifts]) == order
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    assert verify_plan(plan).verified


def test_a_function_sees_the_parts_and_what_each_needs(site):
    seen = []

    def made(parts):
        seen.extend(parts)
        done = []
        while len(done) < len(parts):
            ready = [part for part in parts if part.id not in done and set(part.after) <= set(done)]
            done.append(max(ready, key=lambda part: part.target_m[0]).id)
        return done

    _, preparation = prepare_in_order(site, made)
    assert ids(site, preparation.sequence.order) == ["right", "left", "beam", "slab"]
    by_id = {part.id: part for part in seen}
    assert by_id["beam"].after == ("left", "right")
    assert by_id["slab"].after == ("beam",)
    assert by_id["left"].target_m == pytest.approx((1.0, 1.4, 0.0))
    assert {part.is_lifted for part in seen} == {True}
    assert by_id["left"].mass_kg == site.components[2].mass_kg


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (["beam", "left", "right", "slab"], "beam.* comes before .*left.*, on which it rests; 1 more like this"),
        (lambda parts: ["slab", "beam", "right", "left"], "slab.* comes before .*beam.*, on which it rests|beam.*left"),
        (["left", "right", "beam"], "1 of 4 parts missing: slab"),
        (["left", "left", "right", "beam", "slab"], "more than once: left"),
        (["left", "right", "beam", "slab", "roof"], "no part has the id 'roof'"),
        ([1, 2], "no part has the id 1, 2"),
        (lambda parts: 1 / 0, "order raised ZeroDivisionError: division by zero"),
        (lambda parts: None, "order raised TypeError"),
    ],
)
def test_an_order_that_breaks_a_rule_is_refused_by_name(site, order, said):
    with pytest.raises(InputError, match=said) as caught:
        prepare_in_order(site, order)
    assert caught.value.message.startswith("order")


def test_the_site_files_wishes_hold_for_an_order_too():
    parts = [(*PORTAL[2][:3], {**PORTAL[2][3], "after": ("right",)}), PORTAL[3]]
    site = box_site(parts, rules=Rules(rope=False))
    assert ids(site, prepare_in_order(site, ["right", "left"])[1].sequence.order) == ["right", "left"]
    with pytest.raises(InputError, match=r"left.* comes before .*right.*, as the site file forbids"):
        prepare_in_order(site, ["left", "right"])


def test_notes_and_parts_that_nothing_holds_yet_are_those_of_the_engine():
    parts = [
        ("left", (1.0, 1.4, 0.0), (1.5, 1.9, 3.0)),
        ("shelf", (1.5, 1.4, 2.0), (2.5, 1.9, 2.5)),
    ]
    site = box_site(parts, rules=Rules(rope=False))
    engine, mine = prepare(site), prepare_in_order(site, ["left", "shelf"])[1]
    assert mine.sequence == engine.sequence
    assert ids(site, prepare_in_order(site, ["shelf", "left"])[1].sequence.unheld) == ["shelf"]


def test_a_crane_that_moves_takes_no_order(tmp_path):
    site = row(tmp_path).site
    with pytest.raises(InputError, match="order: the crane of this site moves"):
        prepare_in_order(site, [part.id for part in site.components])


@pytest.fixture(scope="module")
def hall():
    return sequence_problems()["halls"][0].site()


def by_height(parts):
    return sorted(parts, key=lambda part: (part.target_m[2] > 1.0, "y" in part.name, part.target_m[0]))


def test_an_order_may_name_the_crane_of_a_part(hall):
    given = {}

    def order(parts):
        for part in parts:
            given[part.id] = next((crane for crane in part.cranes if crane != part.crane), part.crane)
        return [(part.id, given[part.id]) for part in by_height(parts)]

    site, preparation = prepare_in_order(hall.site, order, free=may_go_to_others(hall))
    assert {site.cranes[part.crane].name for part in site.components} == {"west", "east"}
    assert {part.id: site.cranes[part.crane].name for part in site.components} == given
    changed = sum(a.crane != b.crane for a, b in zip(hall.site.components, site.components, strict=True))
    assert changed > 0
    ordered, noted = as_ordered(hall.site, site, preparation)
    assert sum("as the given order says" in note for note in noted.sequence.notes) == changed
    assert [part.crane for part in ordered.components] == [part.crane for part in site.components]


def test_parts_without_a_named_crane_keep_theirs(hall):
    site, _ = prepare_in_order(hall.site, lambda parts: [part.id for part in by_height(parts)])
    assert site is hall.site


@pytest.mark.parametrize(
    ("crane", "free", "said"),
    [
        ("north", True, "no crane has the name 'north'"),
        ("east", False, "the site file says that west lifts Column 00 0"),
        ("east", True, "east cannot lift Column 00 0"),
    ],
)
def test_a_crane_that_may_not_lift_a_part_is_refused(hall, crane, free, said):
    def order(parts):
        return [(part.id, crane) if part.id == "Column 00 0" else part.id for part in by_height(parts)]

    with pytest.raises(InputError, match=f"order: {said}"):
        prepare_in_order(hall.site, order, free=may_go_to_others(hall) if free else ())
