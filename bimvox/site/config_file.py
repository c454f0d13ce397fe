"""Reader of site files."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from bimvox.errors import ConfigError
from bimvox.site.config import SiteConfig
from bimvox.site.validation import first_finding


def load_site_config(path: Path | str) -> SiteConfig:
    """Return the content of a site file.

    Args:
        path: A TOML file.

    Returns:
        The content with ``name`` set and ``model.path`` resolved against the file's folder.

    Raises:
        ConfigError: If the file cannot be read or is not TOML (line and column), or if a key is unknown, a value is
            not allowed, or the model file does not exist (dotted key).
    """
    path = Path(path)
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(path, None, f"not UTF-8 text (byte {error.start})") from None
    except OSError as error:
        raise ConfigError(
            path, None, f"cannot be read: {error.strerror}", hint="bimvox init MODEL writes one"
        ) from None
    config = parse_site_config(text, path)
    model_path = (path.parent / config.model.path.expanduser()).resolve()
    if not model_path.is_file():
        raise ConfigError(
            path,
            "model.path",
            f"no such file: {model_path}",
            hint="a relative path is relative to the site file's folder",
        )
    model = config.model.model_copy(update={"path": model_path})
    return config.model_copy(update={"model": model, "name": config.name or path.stem})


def parse_site_config(text: str, path: Path | str) -> SiteConfig:
    """Return the content of a site file's text without reading any file; ``path`` is for messages.

    Raises:
        ConfigError: As :func:`load_site_config`, except for the model file.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(path, None, f"not TOML: {error}") from None
    try:
        config = SiteConfig.model_validate(values)
    except ValidationError as error:
        found = first_finding(error, SiteConfig)
        raise ConfigError(path, found.key or None, found.message, available=found.available, hint=found.hint) from None
    config._file = Path(path)
    return config
