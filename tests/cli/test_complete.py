"""The values that the shell offers."""

import typer
from bimvox_cli import complete


def values(offered):
    return [value for value, _ in offered]


def test_cranes_are_kinds_and_machines():
    assert values(complete.cranes("luffing"))[:2] == ["luffing", "luffing-40"]
    assert not complete.cranes("no such")


def test_policies_are_the_stored_ones_and_the_names_that_are_always_there(tmp_path, monkeypatch):
    monkeypatch.setattr("bimvox.policy.store.store_folder", lambda: tmp_path)
    assert values(complete.policies("")) == ["none", "greedy", "default", "nearest"]
    assert values(complete.policies("ne")) == ["nearest"]


def test_a_format_is_offered_once():
    offered = values(complete.formats(""))
    assert {"csv", "ifc", "vti"} < set(offered)
    assert len(offered) == len(set(offered))
    assert ("glb", "of a log or a grid") in complete.formats("g")


def test_layers_are_offered_after_a_comma_and_each_once():
    assert values(complete.layers("paths,wo")) == ["paths,words"]
    assert "paths,paths" not in values(complete.layers("paths,p"))


def test_lifts_without_a_log_are_none(tmp_path):
    command = typer.main.get_command(typer.Typer(callback=lambda: None, invoke_without_command=True))
    context = typer.Context(command)
    assert complete.lifts(context, "") == []
    context.params = {"log": tmp_path / "none.mcap"}
    assert complete.lifts(context, "") == []
