"""Who may connect to the live server."""

from __future__ import annotations

from http import HTTPStatus

import pytest

from bimvox.errors import InputError
from bimvox.log.live.server import TOKEN_VARIABLE, refusal, token_of

TOKEN = "Abc-0123_456789xyz"


def test_a_token_is_random_unless_one_is_given():
    first, second = token_of(None), token_of("")
    assert first != second
    assert min(len(first), len(second)) >= 24
    assert token_of(TOKEN) == TOKEN


@pytest.mark.parametrize("given", ["short", "sixteen letters!", "a/b?c#d-e-f-g-h-i", "x" * 129])
def test_a_token_that_is_weak_or_breaks_the_address_is_refused(given):
    with pytest.raises(InputError, match=TOKEN_VARIABLE):
        token_of(given)


@pytest.mark.parametrize(
    "path", ["/", "", f"/{TOKEN}x", f"/{TOKEN[:-1]}", f"/x?{TOKEN}", TOKEN, f"//{TOKEN}", "/\udcff"]
)
def test_a_client_without_the_token_is_refused(path):
    refused = refusal(path, [], TOKEN)
    assert refused is not None
    assert refused[0] is HTTPStatus.UNAUTHORIZED


@pytest.mark.parametrize(
    "origins",
    [
        [],
        ["https://app.foxglove.dev"],
        ["file://"],
        ["http://localhost"],
        ["http://localhost:8080"],
        ["https://127.0.0.1:1"],
        ["http://[::1]:3000"],
    ],
)
def test_viewers_may_connect(origins):
    assert refusal(f"/{TOKEN}", origins, TOKEN) is None
    assert refusal(f"/{TOKEN}?any=thing", origins, TOKEN) is None


@pytest.mark.parametrize(
    "origins",
    [
        ["https://evil.example"],
        ["null"],
        [""],
        ["http://localhost.evil.example"],
        ["http://localhost:80@evil.example"],
        ["https://app.foxglove.dev.evil.example"],
        ["http://app.foxglove.dev"],
        ["http://localhost:80\n"],
        ["https://app.foxglove.dev", "https://app.foxglove.dev"],
    ],
)
def test_pages_of_other_sites_are_refused_even_if_they_know_the_token(origins):
    refused = refusal(f"/{TOKEN}", origins, TOKEN)
    assert refused is not None
    assert refused[0] is HTTPStatus.FORBIDDEN
