"""A part that was stored turned, as the page's own reckoning has it (run by Node)."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from bimvox.render.page import assets

WEB = Path(assets.__file__).parent / "web"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="Node.js is not here")

BODY = """
import { loadAt, storedAt } from "%s/motion.mjs";
const rows = [[0, 0], [10, 10], [5, 5]];
const yaw = { rad: Math.PI / 2, start_s: 2, end_s: 6 };
const motion = { kind: "crane", time: [0, 10], axes: rows, tip: null, yaw, below_m: [-1, -2, -3] };
const lift = (turn) => ({ start_m: [1, 2, 0.5], start_size_m: [3, 8, 1], stored: "as_built", turn });
console.log(JSON.stringify({
  loads: [0, 4, 8].map((at) => loadAt(motion, [0, 0, 0], "as_built", at)),
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
    assert found["waits"] == [[1, 2, 0.5], [4, 2, 0.5], [4, 10, 0.5], [1, 10, 0.5]]
