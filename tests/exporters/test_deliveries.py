"""The list of deliveries: a row for each part, by truck and in the order of loading."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from datetime import datetime

import seeded_faults as faults
from log_building import tiny_log

from bimvox.exporters.csv_json import DELIVERY_COLUMNS, deliveries_csv, delivery_records, json_bytes
from bimvox.log.plan_log import PlanLog, log_dates

CALENDAR = b"\n[calendar]\nstart = 2026-03-09\nunloading_s = UNLOADING\n"


def dated(unloading_s: int) -> PlanLog:
    made = faults.log_with_a_cast_beam()
    calendar = CALENDAR.replace(b"UNLOADING", str(unloading_s).encode())
    return dataclasses.replace(made, attachments={"site.toml": made.attachments["site.toml"] + calendar})


def test_every_part_is_on_one_truck_and_the_first_lifted_is_loaded_first():
    log = tiny_log()
    trucks = delivery_records(log)
    assert [truck["truck"] for truck in trucks] == list(range(1, len(trucks) + 1))
    parts = [part for truck in trucks for part in truck["parts"]]
    assert sorted(part["component"] for part in parts) == sorted(one.id for one in log.plan.site.components)
    for truck in trucks:
        assert [part["loaded"] for part in truck["parts"]] == list(range(1, truck["parts_on_truck"] + 1))
        numbers = [part["number"] for part in truck["parts"]]
        assert numbers == sorted(numbers)
        assert truck["truck_mass_kg"] == sum(part["mass_kg"] for part in truck["parts"])
        assert truck["needed"] is None


def test_a_truck_is_needed_when_its_unloading_begins_or_at_its_first_lift():
    log = dated(1800)
    dates = log_dates(log)
    (truck, *_) = delivery_records(log, dates)
    begin_ns, end_ns = dates.deliveries[0]
    assert (truck["needed"], truck["unloaded"]) == ("2026-03-09T07:00:00", "2026-03-09T07:30:00")
    assert datetime.fromisoformat(truck["unloaded"]) == dates.moment(end_ns)
    assert begin_ns == 0
    log = dated(0)
    dates = log_dates(log)
    (truck, *_) = delivery_records(log, dates)
    first = min(lift.order for lift in log.planned)
    assert truck["needed"] == truck["unloaded"] == dates.span(first)[0]


def test_the_table_and_the_document_say_the_same():
    log = dated(1800)
    dates = log_dates(log)
    rows = list(csv.DictReader(io.StringIO(deliveries_csv(log, dates))))
    assert list(rows[0]) == list(DELIVERY_COLUMNS)
    document = json.loads(json_bytes(log, dates))["deliveries"]
    told = [(truck["truck"], truck["needed"], part["global_id"]) for truck in document for part in truck["parts"]]
    assert [(int(row["truck"]), row["needed"], row["global_id"]) for row in rows] == told
    assert [float(row["length_m"]) for row in rows] == [
        round(part["length_m"], 6) for truck in document for part in truck["parts"]
    ]


def test_an_extract_lists_its_own_lifts_only():
    (truck,) = delivery_records(tiny_log().extract([0]))
    assert [part["number"] for part in truck["parts"]] == [1]


def test_with_an_access_every_part_has_its_unloading_lift():
    log = dated(1800)
    assert all(part["unloading_s"] is None for truck in delivery_records(log) for part in truck["parts"])
    site = dataclasses.replace(log.plan.site, access=~log.plan.site.yard)
    log = dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))
    parts = [part for truck in delivery_records(log) for part in truck["parts"]]
    assert parts
    for part in parts:
        assert 0.0 < part["truck_utilisation"] <= 1.0
        assert part["truck_radius_m"] >= site.cranes[0].min_radius_m
        assert part["unloading_s"] > 0.0
