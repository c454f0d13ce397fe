"""Writes the SBOM of a wheel: what it needs at run time, with the versions of the lock file (CycloneDX 1.6, JSON).

That is what ``bimvox[full]`` installs.

``python -m supply.sbom WHEEL LOCK...`` writes ``WHEEL.cdx.json`` next to the wheel. The same wheel, lock file and
platform give the same bytes: there is no time in it, and the serial number is made from its content.
"""

from __future__ import annotations

import hashlib
import json
import sys
import uuid
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from email.parser import HeaderParser
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

from supply.lock import Pin, normalised, read_lock

_SERIAL = uuid.UUID("6f0f6a0e-6c3c-5e0e-9d7a-0b1f8a1c2d3e")
_LICENCES = ("License-Expression", "License")
_EXTRA = "full"
_LONGEST_LICENCE = 80  # longer ones are texts, not names


def sbom(wheel: Path, pins: Mapping[str, Sequence[Pin]]) -> dict[str, Any]:
    """Return the SBOM of a wheel as a CycloneDX document.

    Raises:
        ValueError: If a package that the wheel needs is not in the lock file.
        PackageNotFoundError: If one is not installed here, so that its own needs are unknown.
    """
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (one for one in archive.namelist() if one.endswith(".dist-info/METADATA"))
        fields = HeaderParser().parsestr(archive.read(name).decode("utf-8"))
    own_name = normalised(str(fields["Name"]))
    ours = _reference(own_name, str(fields["Version"]))
    needs = {ours: _with_extras_of_its_own(fields.get_all("Requires-Dist") or (), own_name)}
    components: dict[str, dict[str, Any]] = {}
    waiting = list(needs[ours])
    seen: set[tuple[str, frozenset[str]]] = set()
    while waiting:
        package, extras = waiting.pop()
        if (package, extras) in seen:
            continue
        seen.add((package, extras))
        about = metadata(package)
        further = _needed(about.get_all("Requires-Dist") or (), extras)
        pin = _pin_of(package, str(about["Version"]), pins)
        reference = _reference(package, pin.version)
        needs[reference] = needs.get(reference, frozenset()) | further
        components[package] = {
            "type": "library",
            "bom-ref": reference,
            "name": package,
            "version": pin.version,
            "purl": reference,
            **_licences(about),
            "properties": [{"name": "bimvox:lock:file", "value": one} for one in sorted(pin.hashes)],
        }
        waiting.extend(further)
    references = {name: component["bom-ref"] for name, component in components.items()}
    content: dict[str, Any] = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": ours,
                "name": str(fields["Name"]),
                "version": str(fields["Version"]),
                "purl": ours,
                **_licences(fields),
                "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(wheel.read_bytes()).hexdigest()}],
            }
        },
        "components": [components[name] for name in sorted(components)],
        "dependencies": [
            {"ref": ref, "dependsOn": sorted({references[name] for name, _ in needs[ref]})} for ref in sorted(needs)
        ],
    }
    serial = uuid.uuid5(_SERIAL, json.dumps(content, sort_keys=True))
    return {
        "serialNumber": f"urn:uuid:{serial}",
        **content,
    }


def _needed(requirements: Iterable[str], extras: frozenset[str]) -> frozenset[tuple[str, frozenset[str]]]:
    """Return the packages that requirements name on this platform, each with its extras."""
    read = [Requirement(text) for text in requirements]
    return frozenset(
        (normalised(one.name), frozenset(one.extras))
        for one in read
        if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in ("", *extras))
    )


def _with_extras_of_its_own(requirements: Sequence[str], name: str) -> frozenset[tuple[str, frozenset[str]]]:
    """Return the packages that a wheel needs with ``_EXTRA``, which may name other extras of the same wheel."""
    extras = frozenset([_EXTRA])
    while True:
        needed = _needed(requirements, extras)
        named = extras.union(*(more for package, more in needed if package == name))
        if named == extras:
            return frozenset(one for one in needed if one[0] != name)
        extras = named


def _pin_of(name: str, installed: str, pins: Mapping[str, Sequence[Pin]]) -> Pin:
    for pin in pins.get(name, ()):
        if pin.version == installed:
            return pin
    # "2.13.0+cpu" is a build of 2.13.0 for one kind of processor: the hashes of its files are not those of 2.13.0.
    if installed.partition("+")[0] in {pin.version for pin in pins.get(name, ())}:
        return Pin(name, installed, ())
    raise ValueError(
        f"{name} {installed} is installed and needed, but it is not in the lock file: run make constraints"
    )


def _reference(name: str, version: str) -> str:
    return f"pkg:pypi/{name}@{version.replace('+', '%2B')}"


def _licences(about: Any) -> dict[str, Any]:
    for field in _LICENCES:
        text = about.get(field)
        if text and len(text) <= _LONGEST_LICENCE and "\n" not in text:
            if field == "License-Expression":
                return {"licenses": [{"expression": text}]}
            return {"licenses": [{"license": {"name": text}}]}
    return {}


def write_sbom(wheel: Path, locks: Iterable[Path]) -> Path:
    """Write the SBOM next to the wheel; raises as ``sbom`` and ``read_lock`` do."""
    document = sbom(wheel, read_lock(*locks))
    out = wheel.with_name(f"{wheel.name}.cdx.json")
    out.write_text(json.dumps(document, indent=2, sort_keys=True) + "\n", "utf-8")
    return out


def main(arguments: Sequence[str]) -> int:
    """Write the SBOM next to the wheel; return the exit code."""
    wheel, *locks = map(Path, arguments)
    try:
        print(write_sbom(wheel, locks))
    except (OSError, ValueError, PackageNotFoundError) as error:
        print(f"no SBOM is written: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
