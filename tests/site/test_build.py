from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of, frame_house, rasterise_boxes
from box_sites import box_cells
from box_sites import test_crane as some_crane

from bimvox.bim.building import Building, Casting, Role
from bimvox.crane.outline import highest_point_m
from bimvox.errors import ConfigError, SelectionError
from bimvox.grid.frame import Label
from bimvox.planning.stage import refused_by_crane
from bimvox.site import checks
from bimvox.site.build import PlacedModel, build_site, with_obstructions
from bimvox.site.component import StoredPose
from bimvox.site.config.crane import CraneConfig
from bimvox.site.config.rules import RulesConfig
from bimvox.site.config.site_config import (
    AreasConfig,
    ComponentConfig,
    GridConfig,
    ModelConfig,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.lifting import crane_for, hung_kg
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Obstruction, ObstructionSet
from bimvox.site.placement import site_extent
from bimvox.site.site import Site

CONSTRUCTION = ((-1.0, -1.0), (9.0, -1.0), (9.0, 6.0), (-1.0, 6.0))
YARD = ((8.0, -1.0), (20.0, -1.0), (20.0, 6.0), (8.0, 6.0))
CRANE = some_crane(base=(4.0, 10.0, 0.0))


def config(**more) -> SiteConfig:
    more.setdefault("model", ModelConfig(path="a.ifc", voxel_size_m=0.5))
    more.setdefault("areas", AreasConfig(construction=CONSTRUCTION, yard=(YARD,)))
    return SiteConfig(name="plot", **more)


def build(site_config: SiteConfig | None = None, building: Building | None = None, **more) -> Site:
    site_config, building = site_config or config(), building or frame_house()
    cranes = more.setdefault("cranes", (CRANE,))
    frame, shape = site_extent(site_config, building, cranes[0] if cranes else None)
    parts = [(element, rasterise_boxes(element.mesh, frame, shape)) for element in building.elements]
    model = PlacedModel(parts, frame, shape, source=more.pop("source", {}))
    return build_site(site_config, model, rasterise=rasterise_boxes, **more)


def obstructions(*boxes) -> ObstructionSet:
    return ObstructionSet.of([Obstruction(name, Box(low, high)) for name, low, high in boxes])


TRUCK = obstructions(("truck", (12.0, 2.0, 0.0), (14.0, 3.0, 2.0)))


def test_what_is_lifted_what_stands_and_what_is_left_out():
    site = build()
    assert [c.id for c in site.components] == [f"column-{n}" for n in range(4)] + ["beam-0", "beam-1", "slab"]
    assert [c.index for c in site.components] == list(range(7))
    assert [(b.id, b.kind) for b in site.blockers] == [
        ("ground", "ground"), ("footing", "structure"), ("crane", "crane"),
    ]  # fmt: skip
    assert site.blockers[1].mesh is not None
    assert sum(c.erected for c in site.components) == 4
    for component in site.components:
        low, high = component.mesh.bounds_m
        expected = box_cells(site.frame, low, high)
        assert (component.shape.cells + np.array(component.target_vox)).tolist() == expected.tolist()


def test_the_slab_carries_the_areas_and_the_ground():
    site = build()
    i, j = np.indices(site.shape[:2])
    centres = site.frame.centre_of(np.stack([i, j, 0 * i], axis=-1))
    x, y = centres[..., 0], centres[..., 1]
    construction = (x > -1) & (x < 9) & (y > -1) & (y < 6)
    yard = (x > 8) & (x < 20) & (y > -1) & (y < 6) & ~construction
    slab = site.labels[:, :, 0]
    assert ((slab == Label.CONSTRUCTION_AREA) == construction).all()
    assert ((slab == Label.YARD) == yard).all()
    assert ((slab == Label.GROUND) == ~(construction | yard)).all()
    assert (site.yard == yard).all()
    ground = site.blockers[0].cells
    assert len(ground) == site.shape[0] * site.shape[1]
    assert (ground[:, 2] == 0).all()
    assert len(np.unique(ground, axis=0)) == len(ground)


def test_labels_show_all_but_components():
    site = build(obstructions=TRUCK)
    above = site.labels[:, :, 1:]
    assert set(np.unique(above)) == {Label.AIR, Label.STRUCTURE, Label.OBSTRUCTION}
    assert (site.labels == Label.OBSTRUCTION).sum() == 4 * 2 * 4
    solid = np.zeros(site.shape, bool)
    for blocker in site.blockers:
        solid[tuple(blocker.cells.T)] = True
    assert (solid == (site.labels != Label.AIR)).all()


def test_the_mast_stands_from_its_foot_to_the_top_of_the_grid():
    site = build()
    mast = site.blockers[-1].cells
    assert set(mast[:, 2].tolist()) == set(range(1, site.shape[2]))
    low, high = site.frame.corner_of(mast.min(axis=0)), site.frame.corner_of(mast.max(axis=0) + 1)
    assert (low[:2] <= np.array([4.0, 10.0]) - 0.8).all()
    assert (high[:2] >= np.array([4.0, 10.0]) + 0.8).all()
    assert build(cranes=()).blockers[-1].id == "footing"


def test_obstructions_make_a_new_site_and_leave_the_old_one_alone():
    site = build()
    blocked = with_obstructions(site, TRUCK, rasterise_boxes)
    assert [b.id for b in blocked.blockers] == [*(b.id for b in site.blockers), "truck"]
    assert not (site.labels == Label.OBSTRUCTION).any()
    again = with_obstructions(blocked, EMPTY, rasterise_boxes)
    assert again.digest == site.digest
    assert (again.labels == site.labels).all()
    assert build(obstructions=TRUCK).digest == blocked.digest
    with pytest.raises(ValueError, match="read-only"):
        blocked.labels[0, 0, 0] = 1


def test_an_obstruction_over_structure_gives_it_back_when_it_leaves():
    site = build()
    covered = with_obstructions(site, obstructions(("tarp", (0.0, 0.0, 0.0), (2.0, 2.0, 1.0))), rasterise_boxes)
    assert (covered.labels == Label.OBSTRUCTION).any()
    assert (with_obstructions(covered, EMPTY, rasterise_boxes).labels == site.labels).all()


def test_notes_about_obstructions():
    found = obstructions(
        ("far", (90.0, 0.0, 0.0), (91.0, 1.0, 1.0)),
        ("half", (-90.0, 0.0, 0.0), (-1.0, 1.0, 1.0)),
        ("slab", (15.0, 0.0, 0.0), (16.0, 1.0, 1.0)),
    )
    site = build(obstructions=found)
    assert [b.id for b in site.blockers if b.kind == "obstruction"] == ["half", "obstruction:slab"]
    assert any("'far' lies outside" in note for note in site.obstruction_notes)
    assert any("'half' is clipped" in note for note in site.obstruction_notes)
    assert any("'slab' has the id of a part" in note for note in site.obstruction_notes)
    assert with_obstructions(site, EMPTY, rasterise_boxes).obstruction_notes == ()


def test_clearance_grows_obstructions_and_the_mast_by_whole_cells():
    near = build(obstructions=TRUCK)
    apart = build(config(rules=RulesConfig(clearance_m=0.6)), obstructions=TRUCK)
    for index in (-1, -2):
        cells, wide = near.blockers[index].cells, apart.blockers[index].cells
        shape = np.array(near.shape)
        assert (wide.min(axis=0) == np.maximum(cells.min(axis=0) - 2, 0)).all()
        assert (wide.max(axis=0) == np.minimum(cells.max(axis=0) + 2, shape - 1)).all()
    assert near.blockers[1].cells.tolist() == apart.blockers[1].cells.tolist()


def test_digests_change_with_the_content_and_only_with_it():
    site = build()
    same = build()
    assert (same.digest, same.geometry_digest) == (site.digest, site.geometry_digest)
    moved = building_of(
        *frame_house().elements[:-2],
        box_element("slab", (0.0, 0.0, 4.0), (8.0, 5.0, 4.6), ifc_class="IfcSlab"),
    )
    changes = {
        "obstructions": (build(obstructions=TRUCK), False),
        "order": (build(config(component=(ComponentConfig(global_id="beam-0", after=("beam-1",)),))), False),
        "sampling": (build(config(rules=RulesConfig(sample_period_s=0.1))), False),
        "crane's name": (build(cranes=(replace(CRANE, name="other"),)), False),
        "model": (build(source={"sha256": "1"}), False),
        "crane": (build(cranes=(replace(CRANE, jib_length_m=50.0),)), True),
        "no crane": (build(cranes=()), True),
        "shape": (build(building=moved), True),
        "rules": (build(config(rules=RulesConfig(rope=False))), True),
        "zone": (build(config(zone=(ZoneConfig(polygon=CONSTRUCTION),))), True),
        "yard": (build(config(areas=AreasConfig(construction=CONSTRUCTION, yard=(YARD[:3],)))), True),
        "pinned": (build(config(component=(ComponentConfig(global_id="column-0", pinned=True),))), True),
    }
    for what, (other, geometry) in changes.items():
        assert other.digest != site.digest, what
        assert (other.geometry_digest != site.geometry_digest) == geometry, what
    digests = [other.digest for other, _ in changes.values()]
    assert len(set(digests)) == len(digests)


def test_the_name_of_a_site_is_not_part_of_its_identity():
    assert build(config().model_copy(update={"name": "elsewhere"})).digest == build().digest


def test_pinned_parts_stand():
    site = build(config(component=(ComponentConfig(global_id="column-0", pinned=True),)))
    assert "column-0" not in [c.id for c in site.components]
    assert [b.kind for b in site.blockers if b.id == "column-0"] == ["structure"]
    assert [c.index for c in site.components] == list(range(6))


def test_a_zone_forbids_every_column_that_it_meets():
    assert build().prohibited is None
    site = build(config(zone=(ZoneConfig(polygon=((10.1, 0.1), (10.9, 0.1), (10.9, 0.9), (10.1, 0.9))),)))
    columns = site.frame.cell_of([(10.1, 0.1, 0), (10.9, 0.1, 0), (10.1, 0.9, 0), (10.9, 0.9, 0)])[:, :2]
    assert np.argwhere(site.prohibited).tolist() == sorted(columns.tolist())


def test_a_start_is_where_the_part_lies():
    entry = ComponentConfig(global_id="column-0", start=(12.0, 1.0), pose=StoredPose.LYING_X)
    (column, *_) = build(config(component=(entry,))).components
    site = build(config(component=(entry,)))
    assert column.start_vox == tuple(site.frame.cell_of((12.0, 1.0, 0.0)).tolist())
    assert column.start_vox[2] == 1


@pytest.mark.parametrize(
    ("site_config", "key", "said"),
    [
        (config(component=(ComponentConfig(global_id="slab", start=(2.0, 2.0)),)), "component[0].start", "yard"),
        (config(component=(ComponentConfig(global_id="slab", start=(15.0, 1.0)),)), "component[0].start", "yard"),
        (
            config(
                component=(
                    ComponentConfig(global_id="beam-1"),
                    ComponentConfig(global_id="slab", start=(10.0, 0.0, -1.0)),
                )
            ),
            "component[1].start",
            "in the ground",
        ),
        (config(areas=AreasConfig(construction=CONSTRUCTION, yard=(CONSTRUCTION,))), "areas.yard", "no cell"),
        (config(grid=GridConfig(low_m=(0.0, 0.0), high_m=(20.0, 6.0, 4.0))), "grid", "slab"),
    ],
)
def test_what_does_not_fit_is_named_by_its_key(site_config, key, said):
    with pytest.raises(ConfigError, match=said) as caught:
        build(site_config)
    assert caught.value.key == key


def test_a_part_below_the_ground_is_dug_out():
    sunk = building_of(*frame_house().elements, box_element("pit", (1, 1, -1.2), (2, 2, 0.0)))
    site = build(building=sunk)
    assert site.frame.origin_m[2] == -2.0
    (x, y, z) = site.components[-1].target_vox
    assert site.ground_vox[x, y] == z - 1 < site.yard_floor_vox - 1


def test_a_mast_in_the_way_of_a_part_is_refused():
    with pytest.raises(ConfigError, match="slab") as caught:
        build(cranes=(some_crane(base=(4.0, 2.5, 0.0)),))
    assert caught.value.key == "crane.base_m"


def test_terrain_is_the_ground_and_at_least_one_part_is_lifted():
    hill = box_element("hill", (-5, -5, -2), (15, 15, 1), role=Role.GROUND)
    site = build(building=building_of(*frame_house().elements, hill))
    assert site.natural_ground_m is not None
    assert site.natural_ground_m.max() == 1.0
    assert (site.ground_vox == 2).any(), "outside the excavation, the hill is a metre high"
    assert site.ground_vox[tuple(site.components[0].target_vox[:2])] == 1, "it is dug out for what stands in it"
    with pytest.raises(SelectionError, match="nothing to lift"):
        build(building=building_of(box_element("wall", (0, 0, 0), (1, 1, 1), role=Role.STRUCTURE)))


def test_the_mast_of_one_of_several_cranes_ends_where_the_jib_of_a_higher_one_may_turn():
    low = replace(CRANE, name="low", jib_height_m=10.0, jib_length_m=14.0)
    high = replace(CRANE, name="high", base_m=(24.0, 10.0, 0.0), jib_height_m=20.0)
    grid = config(grid=GridConfig(low_m=(-2.0, -2.0), high_m=(26.0, 20.0, 24.0)))
    alone = build(grid, cranes=(low,))
    shared = build(grid, cranes=(low, high))

    def tops_m(site: Site) -> dict[str, float]:
        return {b.id: 0.5 * float(b.cells[:, 2].max()) for b in site.blockers if b.kind == "crane"}

    assert tops_m(alone) == {"crane": pytest.approx(24.0)}
    assert tops_m(shared)["crane:low"] == pytest.approx(highest_point_m(low), abs=0.5)
    assert tops_m(shared)["crane:low"] < 20.0 - shared.rules.crane_separation_m


def test_a_sampling_interval_of_more_samples_than_memory_holds_is_refused(monkeypatch):
    monkeypatch.setattr(checks, "_MOST_SAMPLES", 100_000)
    with pytest.raises(ConfigError, match=r"sample_period_s: 0\.001 s gives about 420,000 samples for 7 lifts") as one:
        build(config(rules=RulesConfig(sample_period_s=0.001)))
    assert "0.005 s or more" in str(one.value)
    assert build(config(rules=RulesConfig(sample_period_s=0.005))).rules.sample_period_s == 0.005
    assert build(config(rules=RulesConfig(sample_period_s=0.001)), cranes=()).rules.sample_period_s == 0.001


ON_A_MACHINE = CraneConfig(machine="hammerhead-30", base_m=(4.0, 10.0, 0.0))


def test_gear_is_chosen_where_the_site_file_does_not_describe_the_rigging():
    site = build(config(crane=ON_A_MACHINE))
    kinds = {component.id: component.lifting.rig.kind for component in site.components}
    assert (kinds["column-0"], kinds["beam-0"], kinds["slab"]) == ("1_leg", "2_legs", "4_legs")
    slab, crane = site.components[-1], site.cranes[0]
    rigged = crane_for(site, crane, slab)
    assert rigged.rigging_mass_kg == slab.lifting.rig.mass_kg
    assert rigged.sling_m == pytest.approx(slab.lifting.rig.height_m)
    assert hung_kg(crane, slab) == slab.mass_kg + slab.lifting.rig.mass_kg + crane.hook_block_kg


@pytest.mark.parametrize("given", [{"sling_m": 2.0}, {"rigging_mass_kg": 100.0}])
def test_a_described_rigging_is_that_of_every_part(given):
    site = build(config(crane=ON_A_MACHINE.model_copy(update=given)))
    assert {component.lifting.rig for component in site.components} == {None}
    assert hung_kg(CRANE, site.components[0]) == site.components[0].mass_kg + CRANE.tackle_kg


def test_a_part_that_no_gear_carries_is_refused_with_the_strongest_gear():
    building = frame_house()
    heavy = {"mass_kg": 150_000.0, "casting": Casting.PRECAST}
    elements = [replace(e, **heavy) if e.id == "slab" else e for e in building.elements]
    site = build(config(crane=ON_A_MACHINE), replace(building, elements=tuple(elements)))
    reason = refused_by_crane(site, site.components[-1])
    assert reason is not None
    assert reason.startswith("no gear serves its 150 t: no shackle carries")
    assert "the largest, bow shackle 55 t, carries 55 t" in reason


def test_what_is_cast_in_place_has_no_gear():
    site = build(config(crane=ON_A_MACHINE, component=(ComponentConfig(global_id="slab", means="in_situ"),)))
    assert site.components[-1].lifting.rig is None
    assert site.components[0].lifting.rig is not None
