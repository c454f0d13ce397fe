"""A layout for Foxglove-class viewers that shows everything in a log; to use it: Layouts, Import from file.

A tree of panels, each with its settings by id, in the viewers' own format.
"""

from __future__ import annotations

import json
from math import hypot
from typing import Any

import numpy as np

from bimvox.crane.kinematics import joint_names
from bimvox.crane.tower_crane import TowerCrane
from bimvox.log import schema as topics
from bimvox.site.site import Site

SCENE_PANEL = "3D!scene"
RATE_PANEL = "Plot!rates"
PHASE_PANEL = "StateTransitions!phases"
COMMAND_PANEL = "Table!command"
LOG_PANEL = "RosOut!log"
_UNITS = {"slewing": "rad", "trolley": "m", "luffing": "rad", "hoist": "m of rope"}
_RATES = ("slew_rate_rad_s", "trolley_rate_m_s", "hoist_rate_m_s")


def crane_panels(crane: TowerCrane, number: int = 0) -> tuple[str, ...]:
    """Return the names of all panels of a crane, from the top of the layout down."""
    joints = [f"Plot!{_own(joint, number)}" for joint in joint_names(crane)]
    return (*joints, *(_own(panel, number) for panel in (RATE_PANEL, PHASE_PANEL, COMMAND_PANEL)))


def foxglove_layout(site: Site) -> dict[str, Any]:
    """Return the layout for the logs of a site: the camera follows from its extent, the panels from its cranes."""
    log = {"foxglovePanelTitle": "log", "topicToRender": topics.LOG, "searchTerms": [], "minLogLevel": 1}
    panels: dict[str, Any] = {SCENE_PANEL: _scene(site), LOG_PANEL: log}
    right: Any = LOG_PANEL
    plots, tables = [], []
    for number, crane in enumerate(site.cranes):
        own = _crane_panels(crane, number, f"{crane.name}: " if site.names_cranes else "")
        panels |= own
        *plotted, table = own
        plots.append(_shared("column", plotted))
        tables.append(table)
    if plots:
        right = _split("column", _shared("row", plots), _split("row", _shared("row", tables), LOG_PANEL, 50), 72)
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 10},
        "layout": _split("row", SCENE_PANEL, right, 62),
    }


def _crane_panels(crane: TowerCrane, number: int, who: str) -> dict[str, Any]:
    """Return a crane's panels by name: its joints, rates and phase, and last the table of its command."""
    joints, command = (topics.of_crane(topic, number) for topic in (topics.JOINTS, topics.COMMAND))
    *of_joints, rates, phase, table = crane_panels(crane, number)
    panels: dict[str, Any] = {}
    for panel, joint in zip(of_joints, joint_names(crane), strict=True):
        value = f'{joints}.joints[:]{{name=="{joint}"}}.position'
        panels[panel] = _plot(f"{who}{joint}, {_UNITS[joint]}", [(value, joint)])
    panels[rates] = _plot(f"{who}commanded rates", [(f"{command}.{rate}", rate) for rate in _RATES])
    panels[phase] = {
        "foxglovePanelTitle": f"{who}phase of the lift",
        "isSynced": True,
        "paths": [
            {"value": f"{command}.{field}", "timestampMethod": "receiveTime", "label": field}
            for field in ("phase", "component_id", "loaded")
        ],
    }
    panels[table] = {"foxglovePanelTitle": f"{who}crane command", "topicPath": command}
    return panels


def _own(panel: str, number: int) -> str:
    """Return the name of a crane's panel, numbered from the second crane on."""
    return panel if number == 0 else f"{panel}_{number + 1}"


def layout_bytes(site: Site) -> bytes:
    """Return the layout as a JSON file; deterministic."""
    return (json.dumps(foxglove_layout(site), indent=1) + "\n").encode()


def _scene(site: Site) -> dict[str, Any]:
    size_m = np.array(site.shape) * site.frame.voxel_size_m
    middle = np.array(site.frame.origin_m) + size_m * [0.5, 0.5, 0.25]
    far_m = round(1.1 * hypot(*size_m.tolist()), 3)
    visible = {"visible": True}
    cranes = range(max(1, len(site.cranes)))
    frames = [topics.of_crane(frame, n) for n in cranes for frame in ("crane_base", "jib", "trolley", "hook")]
    of_cranes: dict[str, Any] = {}
    for n in cranes:
        of_cranes[topics.of_crane(topics.LOAD, n)] = visible | {"type": "axis", "axisScale": 1}
        of_cranes[topics.of_crane(topics.PLANNED, n)] = visible | {"type": "line", "lineWidth": 0.08}
    return {
        "foxglovePanelTitle": site.name,
        "cameraState": {
            "perspective": True,
            "distance": far_m,
            "phi": 58,
            "thetaOffset": 35,
            "targetOffset": [round(float(value), 3) for value in middle],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.5,
            "far": round(20.0 * far_m + 100.0, 3),
        },
        "followMode": "follow-none",
        "followTf": "site",
        "scene": {"backgroundColor": "#f4f4f2", "transforms": {"showLabel": False, "editable": False, "axisScale": 0}},
        "transforms": {f"frame:{frame}": visible for frame in ("site", *frames)},
        "topics": {
            topics.SCENE: visible,
            **of_cranes,
            topics.VOXELS: {"visible": False, "colorField": "label", "colorMode": "colormap", "colorMap": "turbo"},
        },
        "layers": {},
        "publish": {},
        "imageMode": {},
    }


def _plot(title: str, paths: list[tuple[str, str]]) -> dict[str, Any]:
    return {
        "foxglovePanelTitle": title,
        "paths": [
            {"value": value, "label": label, "enabled": True, "timestampMethod": "receiveTime"}
            for value, label in paths
        ],
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": len(paths) > 1,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def _split(direction: str, first: Any, second: Any, percentage: int) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": percentage}


def _shared(direction: str, panels: list[Any]) -> Any:
    """Return panels side by side (``row``) or stacked (``column``), all of the same size."""
    if len(panels) == 1:
        return panels[0]
    return _split(direction, panels[0], _shared(direction, panels[1:]), round(100 / len(panels)))
