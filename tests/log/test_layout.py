"""The layout for viewers is complete, and every path in it leads to a field of the log."""

from __future__ import annotations

import dataclasses
import json
import re
import typing
from typing import Any

from foxglove import layouts
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from log_building import log_bytes, tiny_log

from bimvox.log import schema as topics
from bimvox.log.layout import SCENE_PANEL, foxglove_layout, layout_bytes
from bimvox.log.mcap.reader import read_contents

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
    bare = foxglove_layout(dataclasses.replace(site, cranes=()))
    assert sorted(panels_in(bare["layout"])) == sorted(bare["configById"]) == ["3D!scene", "RosOut!log"]
    assert layout_bytes(site) == layout_bytes(site)
    assert json.loads(layout_bytes(site)) == foxglove_layout(site)


SETTINGS = {
    "3D": "ThreeDeeConfig",
    "Plot": "PlotConfig",
    "StateTransitions": "StateTransitionsConfig",
    "Table": "TableConfig",
    "RosOut": "LogConfig",
}
"""Class of ``foxglove.layouts`` that describes the settings of each kind of panel."""

SERIES = {"Plot": "PlotSeries", "StateTransitions": "StateTransitionsSeries"}
SHOWN = {
    "SceneUpdate": "BaseRendererSceneUpdateTopicSettings",
    "PoseInFrame": "BaseRendererPoseTopicSettings",
    "PosesInFrame": "BaseRendererPosesTopicSettings",
    "VoxelGrid": "BaseRendererVoxelGridTopicSettings",
}
SAVED_ONLY = {"foxglovePanelTitle", "imageMode"}
"""Keys of every saved layout that are not settings of a panel."""


def check_settings(layouts: Any, name: str, given: dict[str, Any]) -> None:
    """Check that Foxglove knows every setting, and its value if the values are enumerated."""
    kind = getattr(layouts, name)
    hints = typing.get_type_hints(kind, vars(layouts))
    needed = {field.name: None for field in dataclasses.fields(kind) if field.default is dataclasses.MISSING}
    for key in given.keys() - SAVED_ONLY:
        assert key in kind(**needed)._to_dict(), f"{name} has no setting {key}"
        hint = hints[re.sub("([A-Z])", lambda found: f"_{found[1].lower()}", key)]
        known = [
            arg
            for part in (hint, *typing.get_args(hint))
            if typing.get_origin(part) is typing.Literal
            for arg in typing.get_args(part)
        ]
        assert not known or given[key] in known, f"{name}: {key} = {given[key]!r} is none of {known}"


def test_every_setting_is_one_that_foxglove_publishes() -> None:
    """Compares with the layout definitions in Foxglove's own package."""
    layout = foxglove_layout(tiny_log().plan.site)
    for panel, settings in layout["configById"].items():
        kind = panel.split("!")[0]
        check_settings(layouts, SETTINGS[kind], settings)
        for path in settings.get("paths", ()):
            check_settings(layouts, SERIES[kind], path)
    for topic, settings in layout["configById"][SCENE_PANEL]["topics"].items():
        check_settings(layouts, SHOWN[TOPICS[topic].DESCRIPTOR.name], settings)


def test_every_topic_of_the_layout_has_messages_in_the_log() -> None:
    log = tiny_log()
    contents = read_contents(log_bytes(log), "tiny.mcap")
    sent = {message.topic for message in contents.messages}
    layout = json.loads(contents.attachments[topics.LAYOUT_FILE])
    shown = {path.split(".")[0] for path in paths_in(layout["configById"])} | set(
        layout["configById"][SCENE_PANEL]["topics"]
    )
    assert shown <= sent
    frames = {key.removeprefix("frame:") for key in layout["configById"][SCENE_PANEL]["transforms"]}
    told = {
        name
        for message in contents.messages
        if message.topic == topics.TF
        for one in FrameTransforms.FromString(message.data).transforms
        for name in (one.parent_frame_id, one.child_frame_id)
    }
    assert frames | {layout["configById"][SCENE_PANEL]["followTf"]} <= told
