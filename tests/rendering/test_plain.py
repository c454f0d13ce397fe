from __future__ import annotations

from bimvox.rendering.words import escape


def test_markup_and_control_characters_are_text():
    assert escape('<b>"\x1b[31m\u202e\x00&') == "&lt;b&gt;&quot;\\x1b[31m\\u202e\\x00&amp;"
