"""``import bimvox`` is fast and lazy, and each of its names is the one that the type checker sees."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import bimvox

HEAVY = ("numpy", "numba", "pydantic", "gymnasium", "shapely", "scipy", "torch", "ifcopenshell", "mcap", "PIL")
VERBS = (
    "export",
    "guess_site",
    "lift_problems",
    "live_job",
    "load_site",
    "optimise",
    "plan",
    "read",
    "read_log",
    "render",
    "revise",
    "sequence_problems",
    "verify",
    "voxelize",
    "write_log",
)


def test_the_import_takes_no_time_and_loads_nothing_heavy():
    code = (
        "import sys, time; began = time.process_time(); import bimvox; spent = time.process_time() - began; "
        f"assert not set({HEAVY!r}) & set(sys.modules), set({HEAVY!r}) & set(sys.modules); print(spent)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 0.1


def test_every_name_is_typed_and_found_where_the_type_checker_finds_it():
    tree = ast.parse(Path(inspect.getfile(bimvox)).read_text())
    typed = {
        alias.name: node.module
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == bimvox._HOME
    assert set(bimvox.__all__) == {*typed, "BimvoxError", "__version__"} == set(dir(bimvox))


@pytest.mark.parametrize("name", sorted(bimvox._HOME))
def test_every_name_is_documented(name):
    value = getattr(bimvox, name)
    assert value.__module__ == bimvox._HOME[name]
    assert inspect.getdoc(value)


@pytest.mark.parametrize("verb", VERBS)
def test_verbs_document_their_arguments_and_stay_functions(verb):
    import bimvox.rendering.page.page
    import bimvox.revision.revise
    import bimvox.voxelization.building

    function = getattr(bimvox, verb)
    assert inspect.isfunction(function)
    text = inspect.getdoc(function) or ""
    for parameter in inspect.signature(function).parameters:
        assert f"{parameter}:" in text, parameter


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'plann'"):
        _ = bimvox.plann
