"""How the crane executes the sample models: time over the bound, and residual swing.

``make bench-motion``: a table of docs/data/measured.txt (ARGS=--write renews it). Paths are found by complete search,
so the result does not depend on a policy store or the machine. Each model is timed twice, with and without swing
shaping.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.document import MEASURED, put_into
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.crane.pendulum import hung_on, swung_parts
from bimvox.proof.motion import verify_motions
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site, SwingRule

SAMPLES = Path(__file__).parents[1] / "sample_models"
MODELS = ("paper.ifc", "frame.ifc", "prefab.ifc", "yard.glb")


def site_of(model: Path) -> Site:
    """Return the site that ``bimvox init`` makes of a model."""
    import bimvox

    return bimvox.guess_site(bimvox.read(model)).site


def swings_m(site: Site, motions: Sequence[LiftMotion]) -> tuple[float, float]:
    """Return the largest swing during loaded motions and the largest residual swing at their ends."""
    assert site.cranes
    peak, left = 0.0, 0.0
    for motion in motions:
        hung = hung_on(
            replace(site, rules=replace(site.rules, swing=SwingRule.SHAPED)),
            site.cranes[motion.crane],
            site.components[motion.component],
        )
        assert hung is not None
        for swung in swung_parts(site.cranes[motion.crane], motion, motion.loaded, hung):
            peak = max(peak, float(np.hypot(*swung.offset_m.T).max()))
        left = max(left, float(swung.amplitude_m[-1]))
    return peak, left


@dataclass(frozen=True, slots=True)
class Driven:
    """How a crane executes a plan."""

    loaded_s: float
    over_bound: float
    worst_over_bound: float
    empty_s: float
    peak_m: float
    left_m: float


def driven(plan: LiftPlan, motions: Sequence[LiftMotion]) -> Driven:
    """Return the figures of motions; fails if they are not proven."""
    proof = verify_motions(plan, motions)
    assert proof.verified, proof.failures
    took = np.array([motion.loaded.duration_s for motion in motions])
    bound = np.array([motion.loaded.bound_s for motion in motions])
    empty_s = sum(m.approach.duration_s for m in motions if m.approach is not None)
    over, worst = float(took.sum() / bound.sum()), float((took / bound).max())
    return Driven(float(took.sum()), over, worst, empty_s, *swings_m(plan.site, motions))


def row(name: str, site: Site) -> str:
    """Plan a site, and return its row of the table: with swing shaping, in brackets without."""
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    assert any(lift.status is Status.PLANNED for lift in plan.lifts)
    own, off = (
        driven(one, time_plan(one, preparation))
        for one in (
            replace(plan, site=replace(site, rules=replace(site.rules, swing=swing)))
            for swing in (SwingRule.SHAPED, SwingRule.OFF)
        )
    )
    lifts = sum(lift.status is Status.PLANNED for lift in plan.lifts)
    return (
        f"| {name} | {lifts} | {own.loaded_s:.0f} ({off.loaded_s:.0f}) s | {own.over_bound:.2f} "
        f"| {own.worst_over_bound:.2f} | {own.empty_s:.0f} s | {own.peak_m:.2f} ({off.peak_m:.2f}) "
        f"| {100.0 * own.left_m:.1f} ({100.0 * off.left_m:.1f}) |"
    )


def main() -> None:
    """Time every sample with and without swing shaping."""
    lines = [
        "| model | lifts | loaded | / bound | worst lift | empty hook | peak swing, m | left at set, cm |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [row(name, site_of(SAMPLES / name)) for name in MODELS]
    print(*lines, sep="\n")
    if "--write" in sys.argv:
        put_into(MEASURED, "bench-motion", "\n".join(lines))


if __name__ == "__main__":
    main()
