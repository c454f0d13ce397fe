"""The page's own program, run by Node."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bimvox.rendering.page import page as assets

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="Node.js is not here")
_PROGRAM = """
import { loadAt } from "%s/motion.mjs";
const { motion, base, times } = %s;
console.log(JSON.stringify(times.map((at) => loadAt(motion, base, "as_built", at))));
"""


def played_load(folder: Path, motion: Any, base_m: Any, times_s: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return where the page shows a load at the given times: its corners and its tilts."""
    assert NODE is not None
    program = folder / "run.mjs"
    given = {"motion": motion, "base": list(base_m), "times": times_s}
    program.write_text(_PROGRAM % ((Path(assets.__file__).parent / "web").as_uri(), json.dumps(given)))
    found = json.loads(subprocess.run([NODE, program], capture_output=True, text=True, check=True).stdout)
    corners, tilts = (np.array([frame[key] for frame in found]) for key in ("corner", "tilt"))
    return corners, tilts


def program_says(folder: Path, prelude: str, body: str) -> Any:
    """Return the value of an expression after a prelude, in which ``WEB`` is the folder of the modules."""
    assert NODE is not None
    program = folder / "said.mjs"
    web = (Path(assets.__file__).parent / "web").as_uri()
    program.write_text(prelude.replace("WEB/", f"{web}/") + f"\nconsole.log(JSON.stringify({body}));")
    done = subprocess.run([NODE, program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
