"""What site files and machine files say about turning parts over between two hooks."""

from dataclasses import replace

import pytest
from box_buildings import box_element, building_of, rasterise_boxes
from own_machine import machine_text
from pydantic import ValidationError

from bimvox.crane.auxiliary import Auxiliary
from bimvox.crane.load_chart import LoadChart
from bimvox.errors import ConfigError
from bimvox.site.build import PlacedModel, build_site
from bimvox.site.catalogue import machine_called
from bimvox.site.component import StoredPose
from bimvox.site.config.crane import AuxiliaryConfig, CraneConfig, OverrideConfig
from bimvox.site.config.machine_file import MACHINE_FILES
from bimvox.site.config.rules import RulesConfig, TwoHooksConfig
from bimvox.site.config.site_config import AreasConfig, ComponentConfig, ModelConfig, SiteConfig
from bimvox.site.default_rules import FlipRules
from bimvox.site.machine import crane_config, crane_of, cranes_of
from bimvox.site.placement import site_extent

YARD = ((10.0, 0.0), (24.0, 0.0), (24.0, 14.0), (10.0, 14.0))
CRANE = CraneConfig(machine="mobile-100t", base_m=(4.0, 14.0), heading_deg=0.0)
PARTS = building_of(
    box_element("wall", (0.0, 0.0, 0.0), (6.0, 0.25, 3.0), ifc_class="IfcWall"),
    box_element("column", (0.0, 4.0, 0.0), (0.5, 4.5, 3.0), ifc_class="IfcColumn"),
)


def config(*components, crane=CRANE, **rules) -> SiteConfig:
    return SiteConfig(
        name="plot",
        model=ModelConfig(path="a.ifc", voxel_size_m=0.25),
        areas=AreasConfig(yard=(YARD,)),
        crane=crane,
        rules=RulesConfig(**rules),
        component=components,
    )


def built(given: SiteConfig):
    cranes = cranes_of(given)
    frame, shape = site_extent(given, PARTS, cranes[0])
    parts = [(element, rasterise_boxes(element.mesh, frame, shape)) for element in PARTS.elements]
    return build_site(given, PlacedModel(parts, frame, shape), cranes=cranes, rasterise=rasterise_boxes)


def test_nothing_is_turned_over_unless_the_site_file_asks():
    site = built(config())
    assert [part.flip_rise_vox for part in site.components] == [0, 0]
    assert site.rules.two_hooks is None and site.cranes[0].auxiliary is None


def test_a_panel_comes_flat_if_it_is_to_be_turned_over():
    site = built(config(ComponentConfig(global_id="wall", flip="two_hooks")))
    wall, column = site.components
    assert (wall.erected, wall.stored_pose, wall.flip_rise_vox) == (True, StoredPose.LYING_Y, 3)
    assert wall.stored_turn == 0
    assert (column.erected, column.flip_rise_vox) == (True, 0)
    assert site.rules.two_hooks == FlipRules()
    assert site.cranes[0].auxiliary == machine_called("mobile-100t").usual.auxiliary
    assert site.cranes[0].second_block_kg == 150.0


def test_the_rule_holds_for_what_comes_lying_and_a_part_may_differ():
    site = built(config(flip="two_hooks", two_hooks=TwoHooksConfig(clear_m=1.0, most_share=0.6)))
    wall, column = site.components
    assert (wall.erected, wall.flip_rise_vox, column.flip_rise_vox) == (False, 0, 5)
    assert site.rules.two_hooks == FlipRules(clear_m=1.0, most_share=0.6)
    foot = built(config(ComponentConfig(global_id="column", flip="foot"), flip="two_hooks"))
    assert [part.flip_rise_vox for part in foot.components] == [0, 0]
    pose = built(config(ComponentConfig(global_id="wall", pose=StoredPose.LYING_Y, turn=0), flip="two_hooks"))
    assert pose.components[0].flip_rise_vox == 3


def test_a_panel_on_its_edge_is_refused_by_name():
    given = ComponentConfig(global_id="wall", pose=StoredPose.LYING_X, flip="two_hooks")
    with pytest.raises(ConfigError, match=r"wall.* cannot be turned over between two hooks as it lies"):
        built(config(given))


def test_the_plan_depends_on_it_and_policies_do_not():
    plain, over = built(config()), built(config(flip="two_hooks"))
    assert plain.fixed_digest != over.fixed_digest
    named = built(config(flip="two_hooks", two_hooks=TwoHooksConfig(turn_s=300.0)))
    assert over.geometry_digest == named.geometry_digest and over.fixed_digest != named.fixed_digest


def test_a_machine_file_states_the_second_hook():
    text = machine_text("LX 9", "mobile-60t").decode()
    assert "[auxiliary]" in text
    machine = MACHINE_FILES.read(text.encode(), "lx.toml")
    assert machine.usual.auxiliary == Auxiliary(LoadChart((1000.0,), (5000.0,)), 120.0, 0.8)
    by_radius = text.replace("capacity_kg = 5000", "chart = [[10, 5000], [20, 3000]]\nrated_percent = 80")
    hook = MACHINE_FILES.read(by_radius.encode(), "lx.toml").usual.auxiliary
    assert (hook.chart.radius_m, hook.chart.capacity_kg, hook.most_share) == ((10.0, 20.0), (5000.0, 3000.0), 0.8)
    without = text[: text.index("[auxiliary]")] + text[text.index("[masses]") :]
    assert MACHINE_FILES.read(without.encode(), "lx.toml").usual.auxiliary is None


@pytest.mark.parametrize("more", [{}, {"capacity_kg": 5000.0, "chart": ((10.0, 5000.0),)}])
def test_a_second_hook_has_one_capacity(more):
    with pytest.raises(ValidationError, match="give capacity_kg, or chart, and not both"):
        AuxiliaryConfig(hook_block_kg=100.0, ahead_m=1.0, **more)


def test_a_site_file_may_state_it_and_the_table_of_a_crane_has_it():
    own = AuxiliaryConfig(capacity_kg=9000.0, hook_block_kg=200.0, ahead_m=1.5)
    given = CRANE.model_copy(update={"override": OverrideConfig(auxiliary=own)})
    crane = crane_of(config(crane=given, flip="two_hooks"))
    assert crane.auxiliary == own.value()
    assert [one.key for one in crane.overrides] == ["auxiliary"]
    again = crane_of(config(crane=crane_config(replace(crane, name="mine", overrides=())), flip="two_hooks"))
    assert again.auxiliary == crane.auxiliary


def test_a_part_that_stands_already_is_not_turned_over():
    with pytest.raises(ValidationError, match="remove its start, pose, turn, flip"):
        ComponentConfig(global_id="wall", pinned=True, flip="two_hooks")
