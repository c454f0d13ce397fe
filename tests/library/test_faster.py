"""The sequence of several cranes is the one whose motions end earlier."""

from __future__ import annotations

import dataclasses

import pytest
from two_cranes import two_crane_site

from bimvox.library import faster
from bimvox.planning.assembly import Preparation, prepare
from bimvox.planning.order.sequence import Sequencer


def with_order(preparation: Preparation, ids: list[str]) -> Preparation:
    site = two_crane_site()
    numbers = {component.id: component.index for component in site.components}
    sequencer = Sequencer(site, preparation.relations, preparation.contacts)
    sequence = sequencer.following([numbers[name] for name in ids])
    assert [site.components[i].id for i in sequence.order] == ids
    return dataclasses.replace(preparation, sequence=sequence)


def test_the_order_whose_motions_end_earlier_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    site = two_crane_site()
    known = prepare(site)
    ends = ["east beam", "west beam", "west bridge"]
    turns = with_order(known, ["west left", "east left", "west right", "east right", *ends])
    blocks = with_order(known, ["west left", "west right", "east left", "east right", *ends])
    monkeypatch.setattr(faster, "faster", lambda *_: turns)
    assert faster.faster_on_the_clock(site, blocks) is turns
    monkeypatch.setattr(faster, "faster", lambda *_: blocks)
    assert faster.faster_on_the_clock(site, turns) is turns
    monkeypatch.setattr(faster, "faster", lambda *_: None)
    assert faster.faster_on_the_clock(site, blocks) is blocks
