"""A user's own machine: a machine of the catalogue under another name."""

from __future__ import annotations

from importlib import resources


def machine_text(name: str, of: str) -> bytes:
    """Return the file of a machine of the catalogue with a name of its own."""
    text = (resources.files("bimvox") / "crane" / "catalogue" / f"{of}.toml").read_text(encoding="utf-8")
    return text.replace(f'name = "{of}"', f'name = "{name}"').encode()
