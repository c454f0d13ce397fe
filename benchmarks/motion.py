"""How the crane executes the sample models: time over the bound, and residual swing.

``make bench-motion``: a table of docs/data/measured.txt. Paths are found by complete search, so the result does not
depend on a policy store or the machine. Each model is timed twice, with and without swing shaping.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bimvox.motion.time_plan import time_plan
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import prepare
from bimvox.proof.crane.pendulum import hanging_m, swung_parts
from bimvox.proof.motion import verify_motions
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site, SwingRule

SAMPLES = Path(__file__).parents[1] / "sample_models"
MODELS = ("paper.ifc", "frame.ifc", "prefab.ifc", "yard.glb")


def site_of(model: Path, folder: Path) -> Site:
    """Return the site that ``bimvox init`` makes of a model."""
    from bimvox_pipeline.site import init

    from bimvox.library.site import load_site
    from bimvox.progress import SilentProgress

    file = folder / f"{model.name}.site.toml"
    init(model, file, progress=SilentProgress())
    return load_site(file, SilentProgress()).site


def swings_m(site: Site, motions: Sequence[LiftMotion]) -> tuple[float, float]:
    """Return the largest swing during loaded motions and the largest residual swing at their ends."""
    assert site.cranes
    peak, left = 0.0, 0.0
    for motion in motions:
        below_m = hanging_m(
            replace(site, rules=replace(site.rules, swing=SwingRule.SHAPED)),
            site.cranes[motion.crane],
            site.components[motion.component],
        )
        assert below_m is not None
        for swung in swung_parts(site.cranes[motion.crane], motion, motion.loaded, below_m):
            peak = max(peak, float(np.hypot(*swung.offset_m.T).max()))
        left = max(left, float(swung.amplitude_m[-1]))
    return peak, left


def row(name: str, plan: LiftPlan, motions: Sequence[LiftMotion]) -> str:
    """Return a row of the table."""
    proof = verify_motions(plan, motions)
    took = np.array([motion.loaded.duration_s for motion in motions])
    bound = np.array([motion.loaded.bound_s for motion in motions])
    ratio = took / bound
    empty_s = sum(m.approach.duration_s for m in motions if m.approach is not None)
    peak_m, left_m = swings_m(plan.site, motions)
    return (
        f"| {name} | {plan.site.rules.swing} | {len(motions)} | {took.sum():.0f} s | {took.sum() / bound.sum():.2f} "
        f"| {ratio.max():.2f} | {empty_s:.0f} s | {peak_m:.2f} m | {left_m * 100:.1f} cm "
        f"| {'yes' if proof.verified else 'NO'} |"
    )


def main() -> None:
    """Time every sample with and without swing shaping."""
    names = sys.argv[1:] or MODELS
    print("| model | swing | lifts | loaded | / bound | worst lift | empty hook | peak swing | left at set | proven |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            site = site_of(SAMPLES / name, Path(folder))
            preparation = prepare(site)
            plan = plan_lifts(site, preparation)
            assert any(lift.status is Status.PLANNED for lift in plan.lifts)
            for swing in (SwingRule.SHAPED, SwingRule.OFF):
                driven = replace(plan, site=replace(site, rules=replace(site.rules, swing=swing)))
                motions = time_plan(driven, preparation)
                print(row(name, driven, motions), flush=True)


if __name__ == "__main__":
    main()
