"""Builds the wheel, its SBOM and their checksums: ``python -m supply.wheel LOCK...`` writes ``dist/``.

The same commit, lock file and platform give the same bytes.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError
from pathlib import Path

from supply.sbom import write_sbom

SUMS = "SHA256SUMS"


class NotBuiltError(Exception):
    """Why there is no wheel or no SBOM of it."""


_BUILD = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"


def build(root: Path, locks: Sequence[Path]) -> list[Path]:
    """Build into ``dist`` of a checkout with the setuptools of this environment; return the files that were made.

    Args:
        root: The checkout; its last commit dates the files in the wheel.
        locks: The lock files, for the SBOM.

    Raises:
        NotBuiltError: If the wheel or its SBOM cannot be made.
    """
    for folder in ("dist", "build"):
        shutil.rmtree(root / folder, ignore_errors=True)
    dist = root / "dist"
    commit = subprocess.run(
        ["git", "log", "-1", "--format=%ct"], cwd=root, capture_output=True, text=True, check=True
    ).stdout.strip()
    made = subprocess.run(
        [sys.executable, "-c", _BUILD, str(dist)],
        cwd=root,
        env={**os.environ, "SOURCE_DATE_EPOCH": commit},
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode:
        raise NotBuiltError(f"the wheel cannot be built: {made.stderr.strip()}")
    (wheel,) = dist.glob("*.whl")
    try:
        write_sbom(wheel, locks)
    except (OSError, ValueError, PackageNotFoundError) as error:
        raise NotBuiltError(f"no SBOM is written: {error}") from error
    files = sorted(dist.iterdir())
    lines = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files]
    (dist / SUMS).write_text("".join(lines), "ascii", newline="\n")
    return [*files, dist / SUMS]


def main(arguments: Sequence[str]) -> int:
    """Build, and print the files or why there are none; return the exit code."""
    try:
        print(*build(Path.cwd(), [Path(lock) for lock in arguments]), sep="\n")
    except NotBuiltError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
