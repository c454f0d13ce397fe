"""Makes a release: ``python -m supply.release VERSION LOCK...`` in a clean checkout of ``main``.

It dates the changelog's section, sets the version, commits, tags and builds ``dist/``. Nothing is pushed.
"""

from __future__ import annotations

import datetime
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from packaging.version import InvalidVersion, Version

from supply.wheel import NotBuiltError, build

_VERSION_FILE = Path("bimvox/version.py")
_CHANGELOG = Path("CHANGELOG.md")


class NotReleasedError(Exception):
    """Why there is no release; nothing was changed."""


def release(root: Path, wanted: str, locks: Sequence[Path], today: datetime.date) -> list[Path]:
    """Make a release; return the files for its page.

    Args:
        root: The checkout.
        wanted: The version, such as ``0.2.0``; at least that of ``bimvox/version.py``.
        locks: The lock files, for the SBOM.
        today: The date for the changelog.

    Raises:
        NotReleasedError: If the checkout is not clean or not ``main``, the version is not new, or the changelog has no
            entries for it.
        NotBuiltError: If the wheel or its SBOM cannot be made; the commit is made, the tag is not.
    """
    _check_checkout(root, wanted)
    changelog, code = root / _CHANGELOG, root / _VERSION_FILE
    notes, source = changelog.read_text("utf-8"), code.read_text("utf-8")
    dated = notes.replace(f"## {wanted} (unreleased)\n", f"## {wanted} ({today.isoformat()})\n")
    section = re.search(rf"^## {re.escape(wanted)} \(.*?\)\n(.*?)(?=^## |\Z)", dated, re.M | re.S)
    if dated == notes or section is None or "- " not in section[1]:
        raise NotReleasedError(f"{_CHANGELOG} has no section '## {wanted} (unreleased)' with entries")
    current = re.search(r'__version__ = "(.+)"', source)
    if current is None or Version(wanted) < Version(current[1]):
        raise NotReleasedError(f"{_VERSION_FILE} is at {current and current[1]}, which is not before {wanted}")
    changelog.write_text(dated, "utf-8", newline="\n")
    code.write_text(source.replace(current[0], f'__version__ = "{wanted}"'), "utf-8", newline="\n")
    _git(root, "commit", "--quiet", "--all", "--message", f"Release {wanted}")
    made = build(root, locks)
    _git(root, "tag", "--annotate", f"v{wanted}", "--message", f"bimvox {wanted}\n\n{section[1].strip()}\n")
    return made


def _check_checkout(root: Path, wanted: str) -> None:
    try:
        Version(wanted)
    except InvalidVersion:
        raise NotReleasedError(f"{wanted!r} is not a version, such as 0.2.0") from None
    if (branch := _git(root, "branch", "--show-current")) != "main":
        raise NotReleasedError(f"this is branch {branch}, releases are made from main")
    if left := _git(root, "status", "--porcelain"):
        raise NotReleasedError(f"the checkout is not clean:\n{left}")
    if _git(root, "tag", "--list", f"v{wanted}"):
        raise NotReleasedError(f"{wanted} is released already: there is a tag v{wanted}")


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NotReleasedError(f"git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout.strip()


def main(arguments: Sequence[str]) -> int:
    """Make the release and print what to do next; return the exit code."""
    wanted, *locks = arguments
    try:
        made = release(Path.cwd(), wanted, [Path(lock) for lock in locks], datetime.datetime.now(datetime.UTC).date())
    except (NotReleasedError, NotBuiltError) as error:
        print(f"no release: {error}", file=sys.stderr)
        return 2
    print(*made, sep="\n")
    print(f"next: git push origin main v{wanted}, then attach these files to the release")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
