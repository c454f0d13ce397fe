from __future__ import annotations

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand

from bimvox.errors import SelectionError
from bimvox.rendering.pictures.picture import PictureOptions, picture_of
from bimvox.rendering.pictures.plan import Instant, scene_of_plan
from bimvox.rendering.pictures.scene import Layer, Scene, layers_named, without

OPTIONS = PictureOptions(size_px=(120, 80), samples=1)


def scene(order: int = 1) -> Scene:
    plan = plan_by_hand(crane=True)
    return scene_of_plan(plan.site, plan.lifts, motions_by_hand(plan), Instant(order, 0.4))


@pytest.mark.parametrize("layer", [layer for layer in Layer if layer is not Layer.WORDS])
def test_every_layer_can_be_left_out(layer: Layer):
    whole = scene(0 if layer is Layer.UNBUILT else 1)
    less = without(whole, {layer})
    assert (picture_of(whole, OPTIONS) != picture_of(less, OPTIONS)).any()
    assert len(less.legend) <= len(whole.legend)
    hidden = [n for n, own in enumerate(whole.layers) if own == layer]
    assert not np.isin(less.solids, hidden).any()
    kept = ~np.isin(whole.solids, hidden)
    np.testing.assert_array_equal(less.solids[kept], whole.solids[kept])


def test_every_solid_of_a_plan_belongs_somewhere_but_the_load():
    whole = scene()
    assert len(whole.layers) == len(whole.palette)
    assert [n for n, layer in enumerate(whole.layers) if n and not layer] == [len(whole.palette) - 1]


def test_nothing_hidden_is_the_scene_itself():
    whole = scene()
    assert without(whole, ()) is whole


def test_an_unknown_layer_is_named_with_the_known_ones():
    assert layers_named(["crane", "words"]) == {Layer.CRANE, Layer.WORDS}
    with pytest.raises(SelectionError) as error:
        layers_named(["cranes"])
    assert "cranes" in error.value.message
    assert "crane" in str(error.value.hint)
