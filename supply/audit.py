"""Compares what is installed in this environment with the lock file, without a network.

``python -m supply.audit LOCK...`` prints what is wrong: a package or version that the lock file does not have, a file
whose bytes are not those of its package, a file that is missing, a file that runs at start-up and is of no package.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import Distribution, distributions
from pathlib import Path

from supply.lock import Pin, normalised, read_lock

OURS = "bimvox"
_AT_START = ("*.pth", "sitecustomize.py", "usercustomize.py")


def findings(pins: Mapping[str, Sequence[Pin]], folder: Path) -> Iterator[str]:
    """Yield what is wrong with the packages installed in a folder, a sentence each."""
    owned: set[Path] = set()
    for distribution in sorted(distributions(path=[str(folder)]), key=lambda one: normalised(one.name)):
        name = normalised(distribution.name)
        versions = [pin.version for pin in pins.get(name, ())]
        # "2.13.0+cpu" is a build of 2.13.0 for one kind of processor (PEP 440, local version identifiers).
        if name != OURS and not {distribution.version, distribution.version.partition("+")[0]} & set(versions):
            expected = f"the lock file has {' and '.join(versions)}" if versions else "it is not in the lock file"
            yield f"{name} {distribution.version} is installed, but {expected}"
        yield from _altered(name, distribution, folder, owned)
    for pattern in _AT_START:
        for file in sorted(folder.glob(pattern)):
            if file.resolve() not in owned:
                yield f"{file.name} runs at every start of Python and is of no installed package"


def _altered(name: str, distribution: Distribution, folder: Path, owned: set[Path]) -> Iterator[str]:
    """Yield the files of a package that are not as its record says; add its files to those that are owned."""
    record = distribution.read_text("RECORD")
    if not record:
        yield f"{name} has no record of its files"
        return
    for path, digest, _ in csv.reader(record.splitlines()):
        file = folder / path
        owned.add(file.resolve())
        if not digest:
            continue
        kind, _, expected = digest.partition("=")
        try:
            with file.open("rb") as stream:
                found = hashlib.file_digest(stream, kind).digest()
        except OSError:
            yield f"{name}: {path} cannot be read or is missing"
            continue
        if base64.urlsafe_b64encode(found).rstrip(b"=").decode() != expected:
            yield f"{name}: {path} is not the file that was installed: its hash differs"


def main(arguments: Sequence[str]) -> int:
    """Print what is wrong with this environment; return the exit code."""
    import sysconfig

    try:
        pins = read_lock(*map(Path, arguments))
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    wrong = list(findings(pins, Path(sysconfig.get_path("purelib"))))
    for one in wrong:
        print(one)
    print(f"{len(wrong)} findings; installed packages and their files compared with {', '.join(arguments)}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
