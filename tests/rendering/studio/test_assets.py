"""The files of the studio's page: complete, found by each other, and nothing from elsewhere."""

import posixpath
import re

from bimvox.rendering.page.page import START, media_type, web_files

IMPORT = re.compile(r'^import (?:[^"]* from )?"([^"]+)";', re.MULTILINE)


def test_every_module_finds_what_it_imports():
    files = web_files()
    modules = [name for name in files if name.startswith("studio/") and name.endswith(".mjs")]
    assert modules
    for name in modules:
        for wanted in IMPORT.findall(files[name].decode()):
            assert wanted.startswith("."), f"{name} imports {wanted}"
            assert posixpath.normpath(posixpath.join(posixpath.dirname(name), wanted)) in files, f"{name}: {wanted}"


def test_the_frame_loads_only_own_files_and_has_nothing_inline():
    files = web_files()
    frame = files[START].decode()
    for address in re.findall(r'(?:src|href)="([^"#]+)"', frame):
        assert address == "data:," or (address.startswith("/web/") and address.removeprefix("/web/") in files), address
    assert not re.search(r"<style|<script(?![^>]*\bsrc=)|\son\w+=|\sstyle=", frame)
    for name, content in files.items():
        if name.startswith("studio/"):
            assert not re.search(rb"https?://(?!www\.w3\.org/)", content), name


def test_only_files_of_the_page_have_a_type():
    assert media_type("main.mjs") == "text/javascript; charset=utf-8"
    assert media_type("secret.toml") is None
    assert all(media_type(name) for name in web_files())
