"""Retraining on a change, by the real trainer: it solves lifts behind new walls that the shipped policy fails."""

import json
from pathlib import Path

import numpy as np
import pytest

from bimvox.library.prove import prepared
from bimvox.library.site import load_obstructions, load_site, obstructed
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.planning.rollout import proposer
from bimvox.policy.choice import PolicyInUse, retrained
from bimvox.policy.generalist.weights import generalist_record, load_generalist
from bimvox.progress import SilentProgress
from bimvox.records.lift import LiftPlan, Method
from bimvox.site.obstructions.coordinates import Survey
from bimvox.site.site import Site

WALLS = 13
STEPS = 4_096

YARD = "yard = [[[-1.5, -11], [8, -11], [8, -2], [-1.5, -2]]]"
FAR_YARD = "yard = [[[-1.5, -32], [8, -32], [8, -26], [-1.5, -26]]]"


@pytest.fixture
def serpentine(site_folder: Path) -> tuple[Site, Preparation]:
    """Return the frame with a distant yard behind walls as high as the site, their gaps at alternating ends."""
    file = site_folder / "frame.site.toml"
    text = file.read_text()
    assert YARD in text
    file.write_text(text.replace(YARD, FAR_YARD))
    sides = ((-20.0, 8.0), (-5.0, 20.0))
    walls = [
        {
            "id": f"wall {n}",
            "box": {"min": [sides[n % 2][0], -24.5 + 1.5 * n, -0.2], "max": [sides[n % 2][1], -24.05 + 1.5 * n, 30]},
        }
        for n in range(WALLS)
    ]
    obstructions = site_folder / "obstructions.json"
    obstructions.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": walls}))
    progress = SilentProgress()
    site = load_site(file, progress).site
    changed = obstructed(site, load_obstructions(obstructions, site, Survey()), progress)
    return changed, prepared(changed, progress)[1]


def by_method(plan: LiftPlan, method: Method) -> tuple[int, ...]:
    return tuple(lift.component for lift in plan.lifts if lift.method is method)


@pytest.mark.slow
def test_failed_lifts_are_solved_after_retraining_deterministically(serpentine, own_store, monkeypatch):
    monkeypatch.setattr("bimvox.policy.choice.RETRAINING_STARTS", 8)
    site, preparation = serpentine
    shipped = PolicyInUse(id=str(generalist_record()["id"]), loaded=True, success_rate=1.0, network=load_generalist())
    propose = proposer(load_generalist())
    failed = by_method(plan_lifts(site, preparation, propose=propose), Method.SEARCH)
    assert failed

    def again() -> PolicyInUse:
        return retrained(site, preparation, shipped, failed=failed, seed=0, steps=STEPS, progress=SilentProgress())

    better = again()
    assert better.parent == shipped.id
    assert 0 < better.steps <= STEPS
    assert better.network is not None
    found = by_method(
        plan_lifts(site, preparation, propose=propose, retrained=proposer(better.network, every_guard=True)),
        Method.RETRAINED,
    )
    assert found
    assert set(found) <= set(failed)

    twice = again()
    assert twice.id == better.id
    assert twice.network is not None
    for one, other in zip(twice.network.weights, better.network.weights, strict=True):
        np.testing.assert_array_equal(one, other)
