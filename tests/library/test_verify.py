from seeded_faults import log_with_a_cast_beam

from bimvox.library.verify import prove_plan
from bimvox.progress import SilentProgress
from bimvox.proof import plan as of_plan
from bimvox.proof.clock import verify_steps
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time


def test_what_carries_a_part_is_measured_once_for_lifts_and_steps(monkeypatch):
    log, made = log_with_a_cast_beam(), []
    of_steps = verify_steps(log.plan, log.motions, log.steps)
    apart = verify_plan_over_time(log.plan, log.motions), verify_motions_over_time(log.plan, log.motions)
    alone = {one.name: one for verdict in apart for one in verdict.checks}
    assert of_steps.samples > 0
    triangles = of_plan.TriangleCheck
    monkeypatch.setattr(of_plan, "TriangleCheck", lambda plan: made.append(plan) or triangles(plan))
    found = {one.name: one for one in prove_plan(log, SilentProgress()).checks}
    assert len(made) == 1
    assert found["steps"] == of_steps
    assert {name: found[name] for name in alone} == alone
