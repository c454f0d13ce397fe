"""Reader of site files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from pydantic import ValidationError

from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES
from bimvox.errors import ConfigError
from bimvox.files import read_input, require_regular, resolved, status_of
from bimvox.site.config.machine_file import MACHINE_FILE
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.config.validation import first_finding
from bimvox.site.nested import UTF8_HINT, WHERE_HINT, toml_values

SITE_FILE = "site.toml"
"""Name of the site file among the files attached to a log."""

_MOST_BYTES = 16 << 20
_MOST_PROGRAMME_BYTES = 256 << 20


def load_site_config(
    path: Path | str, data: bytes | None = None, *, model: Path | None = None, programme: Path | None = None
) -> SiteConfig:
    """Return the content of a site file.

    Args:
        path: A TOML file.
        data: Its bytes, if they have been read.
        model: The model file, instead of the one that it names.
        programme: The programme, instead of the one that it names.

    Returns:
        The content with ``name`` set and ``model.path`` resolved against the file's folder.

    Raises:
        ConfigError: If the file cannot be read or is not TOML (line and column), or if a key is unknown, a value is
            not allowed, or the model file does not exist (dotted key).
    """
    path = Path(path)
    try:
        text = (read_site_file(path) if data is None else data).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(path, None, f"not UTF-8 text (byte {error.start})", hint=UTF8_HINT) from None
    config = parse_site_config(text, path)
    config._machine_files = {name: _next_to(path, name, key) for name, key in named_files(config).items()}
    if programme is not None:
        unreadable = partial(_unreadable, key=None)
        config._programme_file = read_input(programme, unreadable, most_bytes=_MOST_PROGRAMME_BYTES)
        config._programme_given = programme.name
    elif (name := config.sequence.programme) is not None:
        config._programme_file = _next_to(path, name, "sequence.programme", _MOST_PROGRAMME_BYTES)
    model_path = _model_path(path, config.model.path if model is None else model.absolute())
    if status_of(model_path) is None:
        raise ConfigError(
            path,
            "model.path",
            f"no such file: {model_path}",
            hint="a relative path is relative to the site file's folder",
        )
    named = config.model.model_copy(update={"path": model_path})
    return config.model_copy(update={"model": named, "name": config.name or path.stem})


def read_site_file(path: Path) -> bytes:
    """Return the bytes of a site file.

    Raises:
        ConfigError: If it is missing, empty, larger than 16 MiB, not a regular file, or a model.
    """
    if path.suffix.lower() in IFC_SUFFIXES + MESH_SUFFIXES:
        raise ConfigError(path, None, "a model, not a site file", hint=f"bimvox init {path} writes its site file")
    return read_input(path, partial(_unreadable, key=None), most_bytes=_MOST_BYTES)


def _model_path(path: Path, model: Path) -> Path:
    """Return the path of the model, absolute; raise if what is there is not a regular file."""
    of_site = partial(_unreadable, key="model.path", of=path)
    try:
        there = resolved(path.parent / model.expanduser(), of_site)
    except RuntimeError:
        raise ConfigError(path, "model.path", f"no home folder for {model}", hint="write the whole path") from None
    if status_of(there, of_site) is not None:
        require_regular(there, of_site)
    return there


def _unreadable(path: Path, message: str, *, hint: str, key: str | None, of: Path | None = None) -> ConfigError:
    """Return the error about a file that cannot be read: the site file, or a file that it names."""
    return ConfigError(of or path, key, f"{path}: {message}" if of else message, hint=hint)


def named_files(config: SiteConfig) -> dict[str, str]:
    """Return the files of machines, gear and kinds that a site file names, each with the key that names it first."""
    machines = [crane.machine for crane in config.cranes if crane.machine is not None]
    found = {name: "crane.machine" for name in machines if name.endswith(MACHINE_FILE)}
    found |= dict.fromkeys(config.kind_files, "model.kinds")
    return {name: f"rigging.gear[{number}]" for number, name in enumerate(config.rigging.gear)} | found


def _next_to(path: Path, name: str, key: str, most_bytes: int = _MOST_BYTES) -> bytes:
    """Return the bytes of a file next to a site file, which names it in a key."""
    of_site = partial(_unreadable, key=key, of=path)
    if Path(name).name != name:
        raise ConfigError(path, key, f"{name!r} is not next to the site file", hint="give its name alone")
    return read_input(path.parent / name, of_site, most_bytes=most_bytes)


def parse_site_config(
    text: str,
    path: Path | str,
    machine_files: Mapping[str, bytes] | None = None,
    programme: tuple[str, bytes] | None = None,
) -> SiteConfig:
    """Return the content of a site file's text without reading any file.

    ``machine_files``: the files of machines that it may name, by name: their bytes; ``programme``: name and bytes of
    the programme; one that the text does not name takes the place of its own.

    Raises:
        ConfigError: As :func:`load_site_config`, except for the model file.
    """
    try:
        values = toml_values(text)
    except ValueError as error:
        raise ConfigError(path, None, str(error), hint=WHERE_HINT) from None
    try:
        config = SiteConfig.model_validate(values)
    except ValidationError as error:
        found = first_finding(error, SiteConfig)
        raise ConfigError(path, found.key or None, found.message, available=found.available, hint=found.hint) from None
    config._file = Path(path)
    config._machine_files = machine_files or {}
    if programme is not None:
        name, config._programme_file = programme
        config._programme_given = None if name == config.sequence.programme else name
    return config
