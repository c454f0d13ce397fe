"""Builds the wheels, their SBOMs and checksums: ``python -m supply.wheel LOCK...`` writes ``dist/``.

One wheel is for every platform; where it can be made, another one for this platform brings compiled kernels.

The same commit, lock file and platform give the same bytes.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError
from pathlib import Path

from supply.machine_code import TAG, can_compile, compile_into
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
    _built(root, dist, commit)
    if can_compile():
        with tempfile.TemporaryDirectory() as folder:
            try:
                compile_into(Path(folder))
            except OSError as error:
                raise NotBuiltError(str(error)) from error
            _built(root, dist, commit, machine_code=folder)
    try:
        for wheel in sorted(dist.glob("*.whl")):
            write_sbom(wheel, locks)
    except (OSError, ValueError, PackageNotFoundError) as error:
        raise NotBuiltError(f"no SBOM is written: {error}") from error
    files = sorted(dist.iterdir())
    lines = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files]
    (dist / SUMS).write_text("".join(lines), "ascii", newline="\n")
    return [*files, dist / SUMS]


def _built(root: Path, dist: Path, commit: str, *, machine_code: str | None = None) -> None:
    """Build a wheel: a pure one, or with the machine code in a folder one for this platform (see ``setup.py``)."""
    more = {} if machine_code is None else {"BIMVOX_MACHINE_CODE": machine_code, "BIMVOX_TAG": TAG}
    shutil.rmtree(root / "build", ignore_errors=True)
    made = subprocess.run(
        [sys.executable, "-c", _BUILD, str(dist)],
        cwd=root,
        env={**os.environ, "SOURCE_DATE_EPOCH": commit, **more},
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode:
        raise NotBuiltError(f"the wheel cannot be built: {made.stderr.strip()}")


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
