"""The drawing of a site from above, to scale: as SVG, or as a picture by an installed browser."""

from __future__ import annotations

import re
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image

from bimvox.errors import InputError
from bimvox.files import write_atomically
from bimvox.progress import Progress
from bimvox_pipeline.browser import draw_with, find_browser
from bimvox_pipeline.inspect.kinds import Kind
from bimvox_pipeline.render.scene import SceneOptions

SUFFIX = ".svg"
FROM_ABOVE_DEG = 90.0
"""The elevation of the camera that asks for the drawing."""
_INSTEAD = "draw it as .svg"
_SHARP = 2.0
"""Pixels of a picture per unit of the drawing, if no size is given."""
_SIZE = re.compile(r'width="([\d.]+)" height="([\d.]+)"')


def is_drawing(kind: Kind, suffix: str, options: SceneOptions) -> bool:
    """Return whether a drawing from above is asked for."""
    return suffix == SUFFIX or (kind is Kind.SITE and options.elevation_deg == FROM_ABOVE_DEG)


def render_drawing(
    source: Path, kind: Kind, target: Path, size: tuple[int, int] | None, options: SceneOptions, progress: Progress
) -> dict[str, Any]:
    """Write the drawing of a site, and return the document of ``bimvox render --json``.

    Args:
        source: The site file.
        kind: Its kind.
        target: The drawing; ``.png`` needs a browser.
        size: Width and height of a picture in pixels; None: two pixels for each unit of the drawing.
        options: They may ask for the view from above, and for nothing else.
        progress: Receives the stages.

    Raises:
        InputError: If it is not a site file, there is no browser for a picture, or the options ask for another view.
    """
    from bimvox.library.site import read_site
    from bimvox.rendering.report.drawing_file import drawing_file
    from bimvox.rendering.report.site_drawing import drawing_of_site

    if kind is not Kind.SITE:
        raise InputError(f"{source}: only a site file is drawn as SVG", hint=f"-o {target.with_suffix('.png')}")
    _refuse_others(source, options)
    browser = None if target.suffix.lower() == SUFFIX else find_browser("a picture of the drawing", _INSTEAD)
    read = read_site(source, progress)
    progress.stage("draw")
    data = drawing_file(drawing_of_site(read.config, read.building), read.config.name or source.stem)
    if browser is not None:
        data = _picture(data, browser, size)
    progress.stage("write")
    write_atomically(target, data, inputs=[source])
    progress.finish()
    return {"out": str(target), "kind": kind.value, "bytes": len(data), "seconds": progress.seconds}


def _refuse_others(source: Path, options: SceneOptions) -> None:
    given = {
        "--azimuth": options.azimuth_deg,
        "--focus": options.focus,
        "--hide": options.hide or None,
        "--voxel-size": options.voxel_size_m,
        "--elevation": None if options.elevation_deg == FROM_ABOVE_DEG else options.elevation_deg,
    }
    named = next((name for name, value in given.items() if value is not None), None)
    if named is not None:
        raise InputError(f"{source}: the drawing from above has no {named}", hint=f"leave {named} out")


def _picture(svg: bytes, browser: Path, size: tuple[int, int] | None) -> bytes:
    """Return a drawing as PNG; in a given size as large as it fits."""
    words = svg.decode()
    found = _SIZE.search(words)
    assert found is not None
    wide, high = (round(float(one)) for one in found.groups())
    sharp = _SHARP if size is None else 1.0
    wide, high = size or (wide, high)
    words = words.replace(found[0], f'width="{wide}" height="{high}"', 1)
    with tempfile.TemporaryDirectory(prefix="bimvox-draw-") as name:
        source, made = Path(name) / "site.svg", Path(name) / "site.png"
        source.write_text(words, "utf-8")
        options = (f"--screenshot={made}", f"--window-size={wide},{high}", f"--force-device-scale-factor={sharp:g}")
        data = draw_with(browser, source, made, "--hide-scrollbars", *options, instead=_INSTEAD)
    with Image.open(BytesIO(data)) as image, BytesIO() as into:
        # A browser's window has a least size; the drawing is at its top left.
        image.convert("RGB").crop((0, 0, round(wide * sharp), round(high * sharp))).save(into, "PNG")
        return into.getvalue()
