from __future__ import annotations

import sys
from pathlib import Path

# `reference.py` is next to the tests, which are imported by file, so its folder must be added to the path.
sys.path.insert(0, str(Path(__file__).parent))
