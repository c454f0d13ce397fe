"""The layout for viewers: whole, and every path in it leads to a field of the log."""

from __future__ import annotations

import dataclasses
import json
import re
from typing import Any

from bimvox.log import topics
from bimvox.log.layout import SCENE_PANEL, foxglove_layout, layout_bytes

from .building import tiny_log

TOPICS = {topic.name: topic.message for topic in topics.TOPICS}


def panels_in(node: Any) -> list[str]:
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column")
    assert 0 < node["splitPercentage"] < 100
    return [*panels_in(node["first"]), *panels_in(node["second"])]


def paths_in(node: Any) -> list[str]:
    if isinstance(node, dict):
        found = [node[key] for key in ("value", "topicPath", "topicToRender") if isinstance(node.get(key), str)]
        return found + [path for value in node.values() for path in paths_in(value)]
    return [path for value in node for path in paths_in(value)] if isinstance(node, list) else []


def test_every_panel_is_placed_once_and_every_placed_panel_has_its_settings() -> None:
    layout = foxglove_layout(tiny_log().plan.site)
    placed = panels_in(layout["layout"])
    assert sorted(placed) == sorted(layout["configById"])
    assert len(set(placed)) == len(placed)
    kinds = {panel.split("!")[0] for panel in placed}
    assert kinds == {"3D", "Plot", "StateTransitions", "Table", "RosOut"}


def test_every_path_leads_to_a_topic_and_its_field() -> None:
    layout = foxglove_layout(tiny_log().plan.site)
    paths = paths_in(layout["configById"])
    assert len(paths) >= 10
    for path in paths:
        found = re.fullmatch(r"(/[a-z_/]+)(?:\.(\w+)(?:\[:\]\{(\w+)==\"\w+\"\}\.(\w+))?)?", path)
        assert found, path
        topic, field, filtered, inner = found.groups()
        fields = TOPICS[topic].DESCRIPTOR.fields_by_name
        assert field is None or field in fields
        if inner is not None:
            assert {filtered, inner} <= set(fields[field].message_type.fields_by_name)
    assert set(layout["configById"][SCENE_PANEL]["topics"]) <= set(TOPICS)


def test_a_site_without_a_crane_has_no_panels_for_one_and_the_bytes_are_the_same_each_time() -> None:
    site = tiny_log().plan.site
    bare = foxglove_layout(dataclasses.replace(site, crane=None))
    assert sorted(panels_in(bare["layout"])) == sorted(bare["configById"]) == ["3D!scene", "RosOut!log"]
    assert layout_bytes(site) == layout_bytes(site)
    assert json.loads(layout_bytes(site)) == foxglove_layout(site)
