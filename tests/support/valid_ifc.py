"""What IfcOpenShell finds wrong in an IFC file, with the rules of its schema."""

from __future__ import annotations

import ast
from typing import Any

import ifcopenshell
import ifcopenshell.validate
import pytest


def issues(file: ifcopenshell.file) -> list[Any]:
    """Return what is wrong in a file; nothing if it is valid."""
    logger = ifcopenshell.validate.json_logger()
    with pytest.MonkeyPatch.context() as patch:
        # For the explanation of a violated rule it rewrites all rules of the schema at each call, in seconds.
        patch.setattr("_pytest.assertion.rewrite.rewrite_asserts", _say_so)
        ifcopenshell.validate.validate(file, logger, express_rules=True)
    return list(logger.statements)


def _say_so(mod: ast.Module, source: bytes) -> None:
    """Give the assertions of a module a message: the name and text of a violated rule are reported with it."""
    for node in ast.walk(mod):
        if isinstance(node, ast.Assert):
            node.msg = ast.copy_location(ast.Constant("violated"), node)
