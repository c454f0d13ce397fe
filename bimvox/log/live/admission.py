"""Who may connect to the live server: who knows its token, and no page of a foreign site."""

from __future__ import annotations

import hmac
import re
import secrets
from collections.abc import Sequence
from http import HTTPStatus

from bimvox.errors import InputError

TOKEN_VARIABLE = "BIMVOX_SERVE_TOKEN"
"""Environment variable with a token of one's own, for an address that stays the same."""

ORIGINS = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "file://")
"""Origins of viewers; desktop programs give ``file://`` or none. Pages of this machine are allowed too."""

_THIS_MACHINE = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d{1,5})?")
_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,128}")
_TOKEN_BYTES = 18


def token_of(given: str | None) -> str:
    """Return the given token, or a random one if none is given.

    Raises:
        InputError: If the given token is too short, or cannot be part of an address.
    """
    if not given:
        return secrets.token_urlsafe(_TOKEN_BYTES)
    if not _TOKEN.fullmatch(given):
        raise InputError(
            f"{TOKEN_VARIABLE}: not a token of 16 to 128 letters, digits, '-' and '_'",
            hint=f"unset {TOKEN_VARIABLE}; then bimvox makes a random token",
        )
    return given


def refusal(path: str, origins: Sequence[str], token: str) -> tuple[HTTPStatus, str] | None:
    """Return why a request is refused; None if it may connect.

    Args:
        path: Path and query of the request.
        origins: The values of its Origin headers.
        token: The server's token: the path must be ``/TOKEN``.
    """
    given = path.partition("?")[0].encode("utf-8", "surrogateescape")
    if not hmac.compare_digest(given, f"/{token}".encode()):
        return HTTPStatus.UNAUTHORIZED, "The token is missing or wrong: use the whole address that bimvox printed.\n"
    if len(origins) > 1 or not all(origin in ORIGINS or _THIS_MACHINE.fullmatch(origin) for origin in origins):
        return HTTPStatus.FORBIDDEN, "Pages of this origin may not connect.\n"
    return None
