"""What a crane needs out of service."""

from __future__ import annotations

import dataclasses

import pytest
from log_building import tiny_log
from opened_pages import revision_of

from bimvox.crane.outline import outline_of
from bimvox.rendering.report.support import in_words, out_of_service


def revision(**changes):
    log = tiny_log(crane=True)
    crane = dataclasses.replace(log.plan.site.cranes[0], **changes)
    site = dataclasses.replace(log.plan.site, cranes=(crane,))
    return revision_of(dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site)))


def with_cranes(made, *cranes):
    site = dataclasses.replace(made.plan.site, cranes=cranes)
    return dataclasses.replace(made, plan=dataclasses.replace(made.plan, site=site))


def test_the_circle_is_that_of_the_jib_and_is_free_below_it():
    made = revision()
    (found,) = out_of_service(made)
    assert found["radius_m"] == outline_of(made.plan.site.cranes[0]).jib_end_m
    assert found["wind_m_s"] == made.plan.site.cranes[0].max_wind_m_s
    assert found["meets"] == []
    assert "no part, obstruction" in in_words([found])


def test_what_reaches_above_the_jib_is_named():
    made = revision()
    site = made.plan.site
    (found,) = out_of_service(with_cranes(made, dataclasses.replace(site.cranes[0], jib_height_m=2.0)))
    tall = {c.label for c in site.components if c.mesh.bounds_m[1, 2] > found["low_m"]}
    assert tall
    assert tall <= set(found["meets"])
    assert "truck-7" in found["meets"]
    assert "✕ not free to slew" in in_words([found])


def test_what_stands_outside_the_circle_does_not_count():
    made = revision()
    far = dataclasses.replace(made.plan.site.cranes[0], jib_height_m=2.0, base_m=(500.0, 0.0, 0.0))
    (found,) = out_of_service(with_cranes(made, far))
    assert found["meets"] == []


@pytest.mark.parametrize(("apart_m", "meets"), [(15.0, True), (500.0, False)])
def test_another_crane_in_the_circle_counts(apart_m, meets):
    made = revision()
    first = made.plan.site.cranes[0]
    x, y, z = first.base_m
    second = dataclasses.replace(first, name="second", base_m=(x + apart_m, y, z))
    one, other = out_of_service(with_cranes(made, first, second))
    assert ("second" in one["meets"]) == (first.name in other["meets"]) == meets


def test_a_mobile_crane_needs_no_circle():
    (found,) = out_of_service(revision(kind="mobile"))
    assert found["radius_m"] is None
    assert "lowered" in in_words([found])
