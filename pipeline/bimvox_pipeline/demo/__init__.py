"""What ``bimvox demo`` does: the main job on a sample building that ships with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from bimvox.errors import FileError
from bimvox.files import reason_of, write_atomically

SAMPLE = "prefab.ifc"
"""A three-storey precast building of 137 lifts; ``sample_models/prefab.py`` writes it."""


def sample() -> bytes:
    """Return the sample building, an IFC file."""
    return files(__name__).joinpath(SAMPLE).read_bytes()


def copy_sample(folder: Path) -> Path:
    """Write the sample building into a folder, which is made if it does not exist, and return its path."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(folder, f"cannot be used: {reason_of(error)}", hint="name another folder (-o)") from error
    model = folder / SAMPLE
    write_atomically(model, sample())
    return model


def steps(model: Path) -> list[list[str]]:
    """Return the command lines that make grid, site file, log, picture and page of a model, next to it."""
    suffixes = (".zarr.zip", ".site.toml", ".mcap", ".png", ".html")
    grid, site, log, picture, page = (str(model.with_name(model.stem + suffix)) for suffix in suffixes)
    return [
        ["voxelize", str(model), "-o", grid],
        ["init", str(model), "-o", site, "--force"],
        ["plan", site, "-o", log],
        ["verify", log],
        ["render", log, "-o", picture],
        ["render", log, "-o", page],
    ]
