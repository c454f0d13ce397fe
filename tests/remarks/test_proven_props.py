"""A part whose props the proof refuses has none, and the others keep theirs."""

from __future__ import annotations

from dataclasses import replace

import pytest
from propped_sites import ROOM, RULES, checked, made

from bimvox.records.proof import Severity
from bimvox.records.props import Hold, Props
from bimvox.remarks import proven_props as room
from bimvox.remarks.remarks import remarks_of
from bimvox.site.props import FIELD_PROPS


def test_a_refused_prop_costs_neither_the_lift_nor_the_others(monkeypatch: pytest.MonkeyPatch):
    plan, motions = made(ROOM)
    chosen = room.props_of(plan, motions)

    def wrong(*_: object) -> Props:
        held = [
            replace(one, props=one.props[:1]) if plan.site.components[one.component].id == "west" else one
            for one in chosen.held
        ]
        return Props(tuple(held))

    monkeypatch.setattr(room, "props_of", wrong)
    found = room.proven_props.__wrapped__(plan, motions)
    by_name = {plan.site.components[one.component].id: one for one in found.held}
    assert by_name["west"].hold is Hold.NOTHING and not by_name["west"].props
    assert by_name["east"] == next(one for one in chosen.held if one.component == by_name["east"].component)
    assert checked(plan, motions, found).passed


def test_every_part_that_nothing_holds_is_a_serious_remark():
    without = replace(RULES, props=replace(FIELD_PROPS, types=()))
    plan, motions = made(ROOM, without)
    found = {one.component: one for one in remarks_of(plan, motions) if one.kind == "not_held"}
    assert set(found) == {"west", "east"}
    assert all(one.severity is Severity.SERIOUS for one in found.values())
