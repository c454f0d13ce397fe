"""Map coordinates in the lift plan."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
from log_building import tiny_log
from opened_pages import revision_of

from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.support import survey
from bimvox.site.config.site_config import SiteConfig

GEOREFERENCE = {"eastings_m": 1000.0, "northings_m": 2000.0, "height_m": 5.0, "crs": "EPSG:28992"}
ZONE = {"kind": "slow", "name": "school <street>", "polygon": [[0, 0], [1, 0], [1, 1]]}


def revision(**georeference: object):
    log = tiny_log(crane=True)
    site = dataclasses.replace(log.plan.site, site_to_ifc=np.eye(4))
    made = revision_of(dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site)))
    metadata = {**made.metadata, "georeference": json.dumps(georeference)} if georeference else made.metadata
    config = SiteConfig.model_validate({"model": {"path": "a.ifc"}, "zone": [ZONE]})
    return dataclasses.replace(made, metadata=metadata, config=config)


def test_cranes_areas_and_zones_are_set_out():
    made = revision(**GEOREFERENCE)
    record = record_of(made)
    x, y, z = made.plan.site.cranes[0].base_m
    assert list(record["survey"]["cranes"].values()) == [[1000.0 + x, 2000.0 + y, 5.0 + z]]
    assert record["survey"]["zones"][0]["corners"][1] == [1001.0, 2000.0, 5.0]
    assert len(record["survey"]["yard"][0]) == len(record["drawing"]["areas"]["yard"][0])
    html = survey(record)
    assert "in EPSG:28992" in html
    assert "zone 1: school &lt;street&gt;" in html
    assert f'<data value="{1000.0 + x!r}" data-key="E">{1000.0 + x:.3f}</data>' in html


def test_without_a_map_conversion_there_is_no_section():
    for made in (revision(), revision(crs="EPSG:28992"), revision(eastings_m="x")):
        record = record_of(made)
        assert record["survey"] is None
        assert survey(record) == ""
