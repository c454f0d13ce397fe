from __future__ import annotations

import dataclasses
import math

from log_building import tiny_log

from bimvox.remarks.remarks import remarks_if_sensible, remarks_of


def test_a_plan_with_valid_values_has_remarks():
    log = tiny_log()
    found = remarks_if_sensible(log.plan, log.motions, log.context)
    assert found == remarks_of(log.plan, log.motions, log.context)
    assert found


def test_invalid_values_have_no_remarks():
    log = tiny_log()
    first, *others = log.plan.site.components
    site = dataclasses.replace(log.plan.site, components=(dataclasses.replace(first, mass_kg=math.nan), *others))
    assert remarks_if_sensible(dataclasses.replace(log.plan, site=site), log.motions) is None
