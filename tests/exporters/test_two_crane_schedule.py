"""Schedules of lifts by two cranes: as IFC and as Microsoft Project XML, read back."""

from datetime import datetime, timedelta
from pathlib import Path
from xml.etree import ElementTree

import ifcopenshell
import pytest
from valid_ifc import issues

from bimvox.exporters.ifc import with_schedule
from bimvox.exporters.lift_schedule import CraneResource, LiftSchedule, LiftTask
from bimvox.exporters.ms_project import NAMESPACE, to_ms_project

MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
OLD = MODEL.with_name("frame_ifc2x3_mm.ifc")
BEGINS = datetime(2026, 12, 1, 7, 0)
# Order, crane, start, end: the cranes take turns, and their lifts overlap.
SPANS = ((0, 0, 0, 300), (1, 1, 60, 400), (2, 0, 300, 700), (3, 1, 400, 900))


def schedule(model):
    columns = [str(column.GlobalId) for column in ifcopenshell.open(model).by_type("IfcColumn")]
    tasks = tuple(
        LiftTask(order + 1, columns[order], columns[order], f"Lift {order}", "", float(start), float(end), crane)
        for order, crane, start, end in SPANS
    )
    cranes = (CraneResource("west", (("base_x_m", -3.0),)), CraneResource("east", (("base_x_m", 12.5),)))
    return LiftSchedule("hall", "digest 0", BEGINS, tasks, cranes)


@pytest.fixture(scope="module", params=[MODEL, OLD], ids=["IFC4", "IFC2X3"])
def written(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("ifc") / "out.ifc"
    path.write_bytes(with_schedule(request.param, request.param.read_bytes(), schedule(request.param)))
    return ifcopenshell.open(path)


@pytest.mark.slow
def test_an_ifc_holds_both_cranes_and_who_lifts_what(written):
    assert issues(written) == []
    cranes = {crane.Name: crane for crane in written.by_type("IfcTransportElement")}
    assert set(cranes) == {"west", "east"}
    machines = {
        relation.RelatedObjects[0]: relation.RelatingResource for relation in written.by_type("IfcRelAssignsToResource")
    }
    assert {one.Name for one in written.by_type("IfcConstructionEquipmentResource")} == {"west", "east"}
    for number, name in enumerate(("west", "east")):
        assert machines[cranes[name]].Name == name
        lifted = [
            relation.RelatingProcess.Name
            for relation in written.by_type("IfcRelAssignsToProcess")
            if machines[cranes[name]] in relation.RelatedObjects
        ]
        assert lifted == [f"Lift {order}" for order, crane, *_ in SPANS if crane == number]
        (properties,) = [
            relation.RelatingPropertyDefinition
            for relation in written.by_type("IfcRelDefinesByProperties")
            if cranes[name] in relation.RelatedObjects
        ]
        assert properties.HasProperties[0].NominalValue.wrappedValue == (-3.0, 12.5)[number]
    identities = [entity.GlobalId for entity in written.by_type("IfcRoot")]
    assert len(set(identities)) == len(identities)


def test_lifts_of_a_crane_follow_each_other_and_those_of_two_only_end_in_order(written):
    found = {
        (relation.RelatingProcess.Name, relation.RelatedProcess.Name): relation.SequenceType
        for relation in written.by_type("IfcRelSequence")
    }
    assert found == {
        ("Lift 0", "Lift 1"): "FINISH_FINISH",
        ("Lift 0", "Lift 2"): "FINISH_START",
        ("Lift 1", "Lift 2"): "FINISH_FINISH",
        ("Lift 1", "Lift 3"): "FINISH_START",
        ("Lift 2", "Lift 3"): "FINISH_FINISH",
    }


def test_microsoft_project_has_two_resources_and_tasks_that_overlap():
    project = ElementTree.fromstring(to_ms_project(schedule(MODEL)))
    name = {"p": NAMESPACE}
    resources = {
        r.findtext("p:UID", None, name): r.findtext("p:Name", None, name)
        for r in project.iterfind(".//p:Resource", name)
    }
    assert list(resources.values()) == ["west", "east"]
    assigned = {
        a.findtext("p:TaskUID", None, name): resources[a.findtext("p:ResourceUID", None, name)]
        for a in project.iterfind(".//p:Assignment", name)
    }
    assert assigned == {"1": "west", "2": "east", "3": "west", "4": "east"}
    tasks = {task.findtext("p:UID", None, name): task for task in project.iterfind(".//p:Task", name)}
    times = {
        uid: [datetime.fromisoformat(task.findtext(f"p:{key}", None, name)) for key in ("Start", "Finish")]
        for uid, task in tasks.items()
    }
    assert times["2"] == [BEGINS + timedelta(seconds=60), BEGINS + timedelta(seconds=400)]
    assert times["2"][0] < times["1"][1]
    for uid, task in tasks.items():
        for link in task.iterfind("p:PredecessorLink", name):
            before = times[link.findtext("p:PredecessorUID", None, name)][1]
            own = times[uid][0 if link.findtext("p:Type", None, name) == "1" else 1]
            lag_s = int(link.findtext("p:LinkLag", None, name)) * 6
            assert abs(before + timedelta(seconds=lag_s) - own) < timedelta(seconds=6)  # tenths of minutes
