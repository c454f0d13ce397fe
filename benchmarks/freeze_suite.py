"""``python -m benchmarks.freeze_suite``: whether the held-out suite is the frozen one; ``--write`` freezes it anew."""

from __future__ import annotations

import argparse
import sys

from bimvox.policy.generalist.frozen import FROZEN, frozen_text


def main() -> int:
    """Compare or write the frozen file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {FROZEN.name} of the package")
    write = parser.parse_args().write
    text = frozen_text()
    if write:
        FROZEN.write_text(text)
    same = text == FROZEN.read_text()
    sys.stdout.write(f"{FROZEN.name}: {'the same' if same else 'differs from the problems made now'}\n")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
