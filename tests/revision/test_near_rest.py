"""Something that comes too near to where a part is upended, and goes away again."""

from __future__ import annotations

import numpy as np
import pytest
from planned_frame import planned

from bimvox.library.prove import prepared
from bimvox.library.site import rasterise
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.proof.plan import verify_plan
from bimvox.revision.current_plan import RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_obstructions
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet


@pytest.mark.parametrize("order", [0, 2])
def test_a_lift_keeps_less_only_as_long_as_something_is_near(order: int) -> None:
    log = read_log(planned() / "frame.mcap")
    current, preparation = current_plan_of(log.plan, log.motions), prepared(log.plan.site, SilentProgress())[1]
    site, lift = log.plan.site, log.plan.lifts[order]
    assert lift.place is not None
    assert (lift.place.is_upended, lift.kept) == (True, ALL_KEPT)
    low_m = np.array(site.frame.corner_of(np.array(lift.place.cell_vox) - [3, 0, 0])) + 0.1
    box = Obstruction("box", Box(tuple(low_m.tolist()), tuple((low_m + 0.3).tolist())))
    for obstructions, kept_m in ((ObstructionSet.of([box]), 1.0), (ObstructionSet.of([]), None)):
        changed = with_obstructions(site, obstructions, rasterise)
        *_, part = revise(current, RevisionRequest(changed, preparation, first=1000))
        current = part.current
        assert current.plan.lifts[order].kept == ALL_KEPT._replace(upending_clearance_m=kept_m)
        assert verify_plan(current.plan).verified
