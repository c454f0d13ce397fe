import pytest
from box_buildings import box_element

from bimvox.errors import ConfigError
from bimvox.site.config.site_config import ModelConfig, RanksConfig, SequenceConfig, SiteConfig, ZoneConfig
from bimvox.site.parts import first_ids, order_hints

PARTS = [
    box_element("a", (0, 0, 0), (1, 1, 1), storey_height_m=3.0, task="lay", task_rank=4, assembly="frame"),
    box_element("b", (5, 0, 0), (6, 1, 1), storey_height_m=0.0),
    box_element("c", (20, 0, 0), (21, 1, 1)),
]
EAST = ((4.0, -1.0), (8.0, -1.0), (8.0, 2.0), (4.0, 2.0))
WEST = ((-2.0, -1.0), (4.0, -1.0), (4.0, 2.0), (-2.0, 2.0))


def hints_of(zones=(), **sequence):
    config = SiteConfig(model=ModelConfig(path="a.ifc"), zone=zones, sequence=SequenceConfig(**sequence))
    return order_hints(config, PARTS, first_ids(config, PARTS), [("b", "a"), ("a", "elsewhere")])


def test_storeys_count_from_below_and_tasks_and_connections_are_passed_on():
    hints = hints_of()
    assert [hints[n].storey_rank for n in "abc"] == [1, 0, None]
    assert (hints["a"].task, hints["a"].task_rank, hints["a"].assembly) == ("lay", 4, "frame")
    assert hints["a"].connected == ("b", "elsewhere")
    assert hints["c"].connected == ()


def test_storeys_and_the_schedule_can_be_left_out():
    hint = hints_of(storeys=False, schedule=False)["a"]
    assert (hint.storey_rank, hint.task, hint.task_rank) == (None, None, None)


def test_assembly_zones_count_in_the_order_of_the_file_and_prohibited_ones_do_not():
    zones = (
        ZoneConfig(polygon=WEST),
        ZoneConfig(kind="assembly", polygon=EAST, name="east"),
        ZoneConfig(kind="assembly", polygon=WEST),
    )
    hints = hints_of(zones)
    assert [(hints[n].zone, hints[n].zone_name) for n in "abc"] == [(1, "assembly zone 2"), (0, "east"), (None, None)]


def test_an_unknown_first_part_is_named_by_its_key():
    assert hints_of(first=("c",))["c"].first
    with pytest.raises(ConfigError, match=r"sequence.first\[1\]: no component has the id 'd'"):
        hints_of(first=("c", "d"))


def test_a_part_has_the_rank_of_its_class_unless_storeys_are_left_out():
    ranks = RanksConfig(column=7, beam=4)
    post = box_element("post", (0, 0, 0), (0.4, 0.4, 3), ifc_class="IfcColumn")
    beam = box_element("beam", (0, 0, 3), (6, 0.4, 3.5), ifc_class="IfcBeam")
    for sequence, wanted in (
        (SequenceConfig(ranks=ranks), [7, 4]),
        (SequenceConfig(), [1, 2]),
        (SequenceConfig(ranks=ranks, storeys=False), [None, None]),
    ):
        config = SiteConfig(model=ModelConfig(path="a.ifc"), sequence=sequence)
        hints = order_hints(config, [post, beam], frozenset(), [])
        assert [hints[name].rank for name in ("post", "beam")] == wanted
