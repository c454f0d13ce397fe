"""The examples in the help are command lines that the program takes."""

import shlex

import pytest
import typer
from bimvox_cli.examples import EXAMPLES
from bimvox_cli.main import app

ROOT = typer.main.get_command(app)
COMMANDS = {
    f"{name} {deeper}".strip(): one.commands[deeper] if deeper else one
    for name, one in ROOT.commands.items()
    for deeper in getattr(one, "commands", [""])
}


@pytest.mark.parametrize("line", [line for lines in EXAMPLES.values() for line in lines])
def test_an_example_is_a_command_line(line, tmp_path):
    program, name, *arguments = shlex.split(line)
    assert program == "bimvox"
    if hasattr(ROOT.commands[name], "commands"):
        name = f"{name} {arguments.pop(0)}"
    assert line in EXAMPLES[name]
    options = sum(word.startswith("-") for word in arguments)
    command = COMMANDS[name]
    context = command.make_context(name, list(arguments))  # an unknown option or a wrong value is an error
    said = [key for key in context.params if context.get_parameter_source(key).name == "COMMANDLINE"]
    assert len(said) == options + (bool(arguments) and not arguments[0].startswith("-"))


def test_every_command_shows_its_examples(capsys):
    assert set(EXAMPLES) == set(COMMANDS)
    for name, lines in EXAMPLES.items():
        shown = COMMANDS[name].get_help(typer.Context(COMMANDS[name], info_name=name))
        assert all(f"\n    {line}\n" in f"{shown}\n" for line in lines)
