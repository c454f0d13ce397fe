import ifcopenshell
import ifcopenshell.guid
import pytest

from bimvox.bim.ifc.relations import connected_products, element_pairs, storey_height, storey_of, tasks_of_products


class Schedule:
    """A file with beams and tasks."""

    def __init__(self, schema="IFC4"):
        self.file = ifcopenshell.file(schema=schema)

    def rooted(self, ifc_class, **more):
        return self.file.create_entity(ifc_class, GlobalId=ifcopenshell.guid.new(), **more)

    def task(self, name, *products, start=None, kind="CONSTRUCTION", by="product"):
        more = {"IsMilestone": False}
        if self.file.schema != "IFC2X3":
            more["PredefinedType"] = kind
            if start:
                more["TaskTime"] = self.file.create_entity("IfcTaskTime", ScheduleStart=start)
        else:
            more["TaskId"] = name
        task = self.rooted("IfcTask", Name=name, **more)
        for product in products:
            if by == "product":
                self.rooted("IfcRelAssignsToProduct", RelatedObjects=[task], RelatingProduct=product)
            else:
                self.rooted("IfcRelAssignsToProcess", RelatedObjects=[product], RelatingProcess=task)
        return task

    def beam(self):
        return self.rooted("IfcBeam")

    def sequence(self, first, then, kind="FINISH_START"):
        more = {"TimeLag": 0.0} if self.file.schema == "IFC2X3" else {}
        self.rooted("IfcRelSequence", RelatingProcess=first, RelatedProcess=then, SequenceType=kind, **more)

    def ranks(self, *products):
        found, _ = tasks_of_products(self.file)
        return [found[p.id()].rank for p in products]


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4", "IFC4X3"])
@pytest.mark.parametrize("by", ["product", "process"])
def test_sequences_rank_the_products_of_their_tasks(schema, by):
    made = Schedule(schema)
    one, two, three = made.beam(), made.beam(), made.beam()
    late, early, middle = (made.task(n, b, by=by) for n, b in (("late", one), ("early", two), ("middle", three)))
    made.sequence(early, middle)
    made.sequence(middle, late)
    assert made.ranks(one, two, three) == [2, 0, 1]
    assert tasks_of_products(made.file)[0][one.id()].name == "late"


def test_tasks_that_nothing_orders_run_in_parallel_and_dates_order_them():
    made = Schedule()
    one, two, three = made.beam(), made.beam(), made.beam()
    made.task("a", one, start="2026-03-02T08:00:00")
    made.task("b", two, start="2026-03-01T08:00:00")
    made.task("c", three, start="2026-03-02T08:00:00")
    assert made.ranks(one, two, three) == [1, 0, 1]


def test_a_sequence_goes_before_dates_that_contradict_it():
    made = Schedule()
    one, two = made.beam(), made.beam()
    first, then = made.task("a", one, start="2026-03-05"), made.task("b", two, start="2026-03-01")
    made.sequence(first, then)
    assert made.ranks(one, two) == [0, 1]


def test_a_sequence_between_summaries_holds_for_their_subtasks():
    made = Schedule()
    one, two = made.beam(), made.beam()
    first, then = made.task("ground floor"), made.task("first floor")
    made.rooted("IfcRelNests", RelatingObject=first, RelatedObjects=[made.task("a", one)])
    made.rooted("IfcRelNests", RelatingObject=then, RelatedObjects=[made.task("b", two)])
    made.sequence(first, then)
    assert made.ranks(one, two) == [0, 1]


def test_starting_together_is_not_an_order_and_a_circle_is_noted():
    made = Schedule()
    one, two = made.beam(), made.beam()
    first, then = made.task("a", one), made.task("b", two)
    made.sequence(first, then, "START_START")
    assert made.ranks(one, two) == [0, 0]
    made.sequence(first, then)
    made.sequence(then, first)
    assert made.ranks(one, two) == [0, 0]
    assert "in a circle" in tasks_of_products(made.file)[1][0]


def test_building_counts_and_demolition_does_not():
    made = Schedule()
    beam, old, crane = made.beam(), made.beam(), made.rooted("IfcTransportElement")
    made.task("deliver", beam, kind="LOGISTIC", start="2026-01-01")
    made.task("install", beam, crane, kind="INSTALLATION", start="2026-02-01", by="process")
    made.task("remove", old, kind="REMOVAL")
    found, _ = tasks_of_products(made.file)
    assert {n: t.name for n, t in found.items()} == {beam.id(): "install"}


def test_connections_and_their_bolts_become_pairs_of_elements():
    made = Schedule()
    one, two, bolt = made.beam(), made.beam(), made.rooted("IfcMechanicalFastener")
    made.rooted(
        "IfcRelConnectsWithRealizingElements", RelatingElement=one, RelatedElement=two, RealizingElements=[bolt]
    )
    made.rooted("IfcRelConnectsPathElements", RelatingElement=two, RelatedElement=one)
    ids = {one.id(): "one", two.id(): "two"}
    assert element_pairs(connected_products(made.file), ids) == (("one", "two"),)


def test_a_storeys_height_is_its_place_not_its_label():
    made = Schedule()
    file = made.file
    at = file.create_entity("IfcCartesianPoint", (0.0, 0.0, 3.5))
    place = file.create_entity("IfcLocalPlacement", None, file.create_entity("IfcAxis2Placement3D", at))
    storey = made.rooted("IfcBuildingStorey", Name="First", Elevation=0.0, ObjectPlacement=place)
    beam = made.beam()
    made.rooted("IfcRelContainedInSpatialStructure", RelatedElements=[beam], RelatingStructure=storey)
    assert storey_height(storey_of(beam)) == 3.5
    assert storey_of(made.beam()) is None
