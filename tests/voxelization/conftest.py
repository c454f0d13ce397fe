from __future__ import annotations

import sys
from pathlib import Path

# `reference.py` lies beside the tests; they are imported by file, so its folder is not on the path by itself.
sys.path.insert(0, str(Path(__file__).parent))
