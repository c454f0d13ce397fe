"""The report's list of deliveries: arrival and stacks, where there are any."""

from bimvox.rendering.report.sections import deliveries


def table(arrives: str | None, stacks: int, racks: int = 0) -> str:
    lift = {"order": 0, "number": 1, "id": "a", "name": "Slab", "global_id": "a"}
    group = {"delivery": 0, "orders": [0], "mass_kg": 1880.0, "begins_s": 0.0, "ends_s": 60.0}
    return deliveries({"lifts": [lift], "deliveries": [group | {"arrives": arrives, "stacks": stacks, "racks": racks}]})


def test_a_delivery_names_its_arrival_and_its_stacks():
    found = table("Mon 9 March 2026 07:00", 2)
    assert all(said in found for said in ("Arrives", "Mon 9 March 2026 07:00", "Stacks", ">2<"))


def test_without_dates_or_stacks_there_are_no_such_columns():
    found = table(None, 0)
    assert "Arrives" not in found
    assert "Stacks" not in found
    assert "Racks" not in found


def test_a_delivery_names_its_racks():
    found = table(None, 0, 3)
    assert "Racks" in found
    assert ">3<" in found
