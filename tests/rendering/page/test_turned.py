"""A part that was stored turned, as the page's own program computes it (run by Node)."""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bimvox.rendering.page import page as assets
from bimvox.rendering.pictures.film_scene import rotation

WEB = Path(assets.__file__).parent / "web"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="Node.js is not here")

BODY = """
import { loadAt, storedAt } from "%s/motion.mjs";
const rows = [[0, 0], [10, 10], [5, 5]];
const yaw = { rad: Math.PI / 2, start_s: 2, end_s: 6 };
const motion = { kind: "crane", time: [0, 10], axes: rows, tip: null, yaw, below_m: [-1, -2, -3] };
const lift = (turn) => ({ start_m: [1, 2, 0.5], start_size_m: [3, 8, 1], stored: "as_built", turn });
const poses = [["lying_x", 0], ["lying_x", 1], ["lying_y", 1], ["lying_y", 2], ["lying_x", 3]];
const tipping = (pose, turn) => {
  const [x, y] = turn %% 2 ? [1, 2] : [2, 1];
  const offset = [turn === 1 || turn === 2 ? x : 0, turn > 1 ? y : 0, 0];
  const height = 0.5 + (pose === "lying_x" ? x : y);
  const tip = {
    time: [0, 9], columns: [[height, 0.5], [Math.PI / 2, 0]], corner_m: [1, 2, height], offset_m: offset, end_s: 9,
  };
  return { ...motion, tip, yaw: { rad: (turn * Math.PI) / 2, start_s: 10, end_s: 11 } };
};
console.log(JSON.stringify({
  loads: [0, 4, 8].map((at) => loadAt(motion, [0, 0, 0], "as_built", at)),
  lies: poses.map(([pose, turn]) => storedAt({ ...lift(turn), stored: pose }, { size_m: [2, 1, 6] })),
  tips: poses.map(([pose, turn]) => loadAt(tipping(pose, turn), [0, 0, 0], pose, 0)),
  waits: [0, 1, 2, 3].map((turn) => storedAt(lift(turn), { size_m: [8, 3, 1] }).corner),
}));
"""


def test_it_hangs_and_waits_turned(tmp_path):
    assert NODE is not None
    program = tmp_path / "run.mjs"
    program.write_text(BODY % WEB.as_uri())
    found = json.loads(subprocess.run([NODE, program], capture_output=True, text=True, check=True).stdout)
    turned, half_way, straight = found["loads"]
    half = 0.5**0.5
    assert turned["corner"] == pytest.approx([12, -1, 2])
    assert turned["tilt"] == pytest.approx([0, 0, half, half])
    assert half_way["corner"] == pytest.approx([10 + half, -3 * half, 2])
    assert straight["corner"] == pytest.approx([9, -2, 2])
    assert straight["tilt"] == pytest.approx([0, 0, 0, 1])
    assert found["waits"] == [[1, 2, 0.5], [4, 2, 0.5], [9, 5, 0.5], [1, 10, 0.5]]


def test_it_lies_turned_inside_its_box_and_is_tipped_up_from_there(tmp_path):
    """Its eight corners fill the box of the stored part, 6 m long from (1, 2, 0.5)."""
    assert NODE is not None
    program = tmp_path / "run.mjs"
    program.write_text(BODY % WEB.as_uri())
    found = json.loads(subprocess.run([NODE, program], capture_output=True, text=True, check=True).stdout)
    sizes = {("lying_x", 0): (6, 1, 2), ("lying_x", 1): (6, 2, 1), ("lying_y", 1): (1, 6, 2)}
    sizes |= {("lying_y", 2): (2, 6, 1), ("lying_x", 3): (6, 2, 1)}
    corners = np.array(list(itertools.product((0.0, 2.0), (0.0, 1.0), (0.0, 6.0))))
    for lies, tips, size in zip(found["lies"], found["tips"], sizes.values(), strict=True):
        for frame in (lies, tips):
            filled = corners @ rotation(np.array(frame["tilt"])).T + frame["corner"]
            np.testing.assert_allclose(filled.min(axis=0), [1, 2, 0.5], atol=1e-9)
            np.testing.assert_allclose(filled.max(axis=0), np.add([1, 2, 0.5], size), atol=1e-9)
