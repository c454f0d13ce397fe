"""The examples in the help are command lines that the program takes."""

import shlex

import pytest
import typer
from bimvox_cli.examples import EXAMPLES
from bimvox_cli.main import app


@pytest.mark.parametrize("line", [line for lines in EXAMPLES.values() for line in lines])
def test_an_example_is_a_command_line(line, tmp_path):
    program, name, *arguments = shlex.split(line)
    assert program == "bimvox"
    assert line in EXAMPLES[name]
    options = sum(word.startswith("-") for word in arguments)
    command = typer.main.get_command(app).commands[name]
    context = command.make_context(name, list(arguments))  # an unknown option or a wrong value is an error
    said = [key for key in context.params if context.get_parameter_source(key).name == "COMMANDLINE"]
    assert len(said) == options + (bool(arguments) and not arguments[0].startswith("-"))


def test_every_command_shows_its_examples(capsys):
    commands = typer.main.get_command(app).commands
    assert set(EXAMPLES) == {name for name, command in commands.items() if not hasattr(command, "commands")}
    for name, lines in EXAMPLES.items():
        shown = commands[name].get_help(typer.Context(commands[name], info_name=name))
        assert all(f"\n    {line}\n" in f"{shown}\n" for line in lines)
