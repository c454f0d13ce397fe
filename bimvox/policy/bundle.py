"""A stored policy as one file: a zip of the two files of its folder, uncompressed.

Reading one runs no code, and writes nothing to disk before it has been checked.
"""

from __future__ import annotations

import io
import zipfile

from bimvox.errors import PolicyError
from bimvox.grid.layout import BROKEN_ZIP, write_archive


def pack(files: dict[str, bytes]) -> bytes:
    """Return files as the bytes of a zip; the same files give the same bytes."""
    buffer = io.BytesIO()
    write_archive(buffer, sorted(files.items()))
    return buffer.getvalue()


def unpack(content: bytes, names: tuple[str, ...], largest_bytes: int) -> dict[str, bytes]:
    """Return the files of a zip of :func:`pack`.

    Args:
        content: The zip.
        names: The files that it must hold, and no others.
        largest_bytes: Largest size of a file.

    Raises:
        PolicyError: It is not such a zip, or it is damaged.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            held = sorted(info.filename for info in archive.infolist())
            if held != sorted(names):
                shown = ", ".join(held[:5]) or "nothing"
                raise PolicyError(
                    f"holds {shown}, not {' and '.join(sorted(names))}",
                    differs={"files": (held, sorted(names))},
                    hint="a file of `bimvox policy export` is needed; for one of stable-baselines3 add --trust",
                )
            for info in archive.infolist():
                if info.file_size > largest_bytes:
                    raise PolicyError(f"{info.filename}: {info.file_size:,} bytes, more than a policy can have")
            return {name: archive.read(name) for name in names}
    except BROKEN_ZIP as error:
        raise PolicyError(f"not a whole zip file: {error}", hint="copy or export it again") from error
