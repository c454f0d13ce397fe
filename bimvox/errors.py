"""The error tree. The library raises; only ``cli`` turns an error into an exit code.

::

    BimvoxError
    ├── InputError               bad input: exit code 2
    │   ├── FileError            a file that is missing, unreadable, empty, truncated or garbage
    │   │   ├── IfcError         an IFC file that cannot be used
    │   │   ├── MeshError        a mesh file that cannot be used
    │   │   ├── GridFileError    a grid file that is damaged or not from bimvox
    │   │   ├── LogFileError     a log that is damaged or not from bimvox
    │   │   └── ObstructionFileError
    │   ├── ConfigError          a site file with an unknown key or an impossible value
    │   ├── GridTooLargeError    more cells than allowed; names a cell size that fits
    │   ├── SelectionError       nothing, or nothing usable, was selected
    │   ├── PolicyError          a policy that is missing, damaged or does not fit
    │   ├── ActionError          an action outside an environment's action space
    │   └── MissingPackageError  an optional package that is not installed
    └── PlanningError            no valid plan, or a check failed: exit code 1
        ├── NoPlanError          not a single lift could be planned
        ├── SequenceError        no erection sequence satisfies the site file
        ├── MotionError          a proven path that the crane cannot execute; names the part
        └── VerificationError    a proof failed; nothing was written

Every error carries its evidence as fields. Its message says what is wrong and where; its hint says what to do.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any


def shown(value: object) -> str:
    """Return a value as a message repeats it: a text in quotes, numbers as people write them, cut."""
    return cut(repr(_of_python(value)))


def _of_python(value: object) -> object:
    """Return a value with Python's numbers for numpy's: ``(17, 3)``, not ``(np.int32(17), np.int32(3))``."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if type(value) is list:
        return [_of_python(one) for one in value]
    return tuple(_of_python(one) for one in value) if type(value) is tuple else value


def cut(text: str, most: int = 80) -> str:
    """Return a text of at most ``most`` characters; dots show that it was longer."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def listed(names: Iterable[str], most: int = 20) -> str:
    """Return names as text: the first few, each shortened, and how many more there are."""
    every = list(names)
    more = f" and {len(every) - most:,} more" if len(every) > most else ""
    return ", ".join(cut(name, 200) for name in every[:most]) + more


def enumerated(words: Sequence[str]) -> str:
    """Return words as part of a sentence: ``a, b and c``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


class BimvoxError(Exception):
    """Root of all errors that bimvox raises.

    Args:
        message: What is wrong, and where.
        hint: What to do about it, one sentence.
    """

    code = "error"

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\n  hint: {self.hint}" if self.hint else self.message

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how it is restored in another process: with its evidence, whatever its constructor takes."""
        return _restored, (type(self), self.args, self.__dict__)


def _restored(kind: type[BimvoxError], args: tuple[object, ...], evidence: dict[str, Any]) -> BimvoxError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(evidence)
    return error


class InputError(BimvoxError):
    """Bad input, which the user can correct."""

    code = "input"


class FileError(InputError):
    """A file that is missing, unreadable, empty, truncated or garbage."""

    code = "file"

    def __init__(self, path: Path | str, message: str, *, hint: str | None = None) -> None:
        super().__init__(f"{path}: {message}", hint=hint)
        self.path = Path(path)


class IfcError(FileError):
    """An IFC file that cannot be used."""

    code = "ifc"


class MeshError(FileError):
    """A mesh file that cannot be used."""

    code = "mesh"


class GridFileError(FileError):
    """A grid file that is damaged, malicious, or not from bimvox; its hint says how to get a good one."""

    code = "grid"

    def __init__(self, path: Path | str, message: str, *, hint: str | None = None) -> None:
        damaged = "the file is damaged or not a bimvox grid: create it again with bimvox voxelize MODEL"
        super().__init__(path, message, hint=hint or damaged)


class LogFileError(FileError):
    """A log that is damaged or not from bimvox."""

    code = "log"


def _at(key: str | None, message: str) -> str:
    """Return a message with the key that it is about: ``KEY is missing``, otherwise ``KEY: message``."""
    if not key:
        return message
    return f"{key} {message}" if message.startswith("is missing") else f"{key}: {message}"


class ObstructionFileError(FileError):
    """An obstruction file that cannot be used; ``key`` is the place in the file."""

    code = "obstructions"

    def __init__(self, path: Path | str, message: str, *, key: str | None = None, hint: str | None = None) -> None:
        super().__init__(path, _at(key, message), hint=hint)
        self.key = key


class ConfigError(InputError):
    """A site file with an unknown key or an impossible value; ``key`` is the dotted key in the file."""

    code = "config"

    def __init__(
        self,
        path: Path | str,
        key: str | None,
        message: str,
        *,
        available: Sequence[str] = (),
        hint: str | None = None,
    ) -> None:
        super().__init__(f"{path}: {_at(key, message)}", hint=hint)
        self.path = Path(path)
        self.key = key
        self.available = tuple(available)


class GridTooLargeError(InputError):
    """The grid would have more cells than allowed."""

    code = "grid-too-large"

    def __init__(self, cells: int, limit: int, voxel_size_m: float, fitting_voxel_size_m: float) -> None:
        super().__init__(
            f"a grid of {cells:,} cells at {voxel_size_m:g} m exceeds the limit of {limit:,} cells",
            hint=f"use a voxel_size_m of {fitting_voxel_size_m:g} (--voxel-size {fitting_voxel_size_m:g}), which fits",
        )
        self.cells = cells
        self.limit = limit
        self.voxel_size_m = voxel_size_m
        self.fitting_voxel_size_m = fitting_voxel_size_m


class SelectionError(InputError):
    """Nothing, or nothing usable, was selected."""

    code = "selection"


class NothingSelectedError(SelectionError):
    """A selection that can be read, but matches nothing."""


class PolicyError(InputError):
    """A policy that is missing, damaged, or does not fit the site; ``differs`` holds the differences."""

    code = "policy"

    def __init__(self, message: str, *, differs: Mapping[str, object] | None = None, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.differs = dict(differs or {})


class ActionError(InputError, ValueError):
    """An action outside an environment's action space; ``actions`` is what was given."""

    code = "action"

    def __init__(self, message: str, *, actions: object) -> None:
        super().__init__(message)
        self.actions = actions


class MissingPackageError(InputError):
    """An optional package that is not installed; ``package`` is its name."""

    code = "missing-package"

    def __init__(self, package: str, purpose: str, *, install: str | None = None) -> None:
        super().__init__(
            f"{purpose} needs the package {package}, which is not installed", hint=install or f"pip install {package}"
        )
        self.package = package


class PlanningError(BimvoxError):
    """No valid plan, or a check failed."""

    code = "planning"


class NoPlanError(PlanningError):
    """Not a single lift could be planned; ``reasons`` maps a component's id to the reason."""

    code = "no-plan"

    def __init__(self, message: str, *, reasons: Mapping[str, str] | None = None, hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.reasons = dict(reasons or {})


class SequenceError(PlanningError):
    """No erection sequence satisfies the site file; ``cycle`` holds the ids that wait for each other, in order."""

    code = "no-order"

    def __init__(self, message: str, *, cycle: Sequence[str], hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.cycle = tuple(cycle)


class MotionError(PlanningError):
    """A proven path that the crane cannot execute; ``component`` is the id of the part."""

    code = "motion"

    def __init__(self, component: str, message: str, *, hint: str | None = None) -> None:
        super().__init__(f"{component}: {message}", hint=hint)
        self.component = component

    @property
    def reasons(self) -> Mapping[str, str]:
        """The message by component; of several components if several paths cannot be executed."""
        return {self.component: self.message}


class VerificationError(PlanningError):
    """A proof failed; ``failures`` lists each failure with its place."""

    code = "verification"

    def __init__(self, message: str, *, failures: Sequence[str] = (), hint: str | None = None) -> None:
        super().__init__(message, hint=hint)
        self.failures = tuple(failures)
