import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from bimvox_cli import main

_GROUP = typer.main.get_command(main.app)
COMMANDS = tuple(_GROUP.commands)
DEEP_COMMANDS = tuple(
    f"{name} {deeper}".strip() for name, one in _GROUP.commands.items() for deeper in getattr(one, "commands", [""])
)
HEAVY = ("torch", "stable_baselines3", "trimesh", "numba", "ifcopenshell", "numpy", "scipy", "mcap", "rich")


def run_python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=os.environ | environment
    )


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["--version"], ["voxelize", "--help"], ["plan", "-h"]])
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "import sys; from bimvox_cli.main import run; code = run(sys.argv[1:] or "
        f"{arguments!r}); print('LOADED', *[m for m in {HEAVY!r} if m in sys.modules]); sys.exit(code)"
    )
    done = run_python(code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "LOADED"


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["-h", "--help"])
def test_every_command_explains_itself(command: str, option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run([command, option]) == 0
    out, err = capsys.readouterr()
    assert f"Usage: bimvox {command}" in out
    assert err == ""


@pytest.mark.parametrize("command", COMMANDS)
def test_the_list_of_commands_fits_its_lines(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    main.run(["-h"])
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith(f"  {command} "))
    assert not line.endswith("...")


@pytest.mark.parametrize("command", DEEP_COMMANDS)
def test_help_shows_no_types_and_no_braces(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run([*command.split(), "-h"]) == 0
    out = capsys.readouterr().out
    usage, arguments = out.split("\n\n")[0], out.partition("Arguments:\n")[2].partition("Options:")[0]
    assert not re.search(r"[{}<>]|\[\[", usage)
    assert not re.search(r"[<>{}]|\[required\]", arguments)
    assert not re.search(r"<(path|str|int|float|list\S*)>|Path\b", out)


@pytest.mark.parametrize(
    ("command", "usage"),
    [
        ("plan", "[OPTIONS] SITE..."),
        ("cranes", "[OPTIONS] [SITE]"),
        ("export", "[OPTIONS] LOG|GRID"),
        ("schema", "[OPTIONS] FORMAT"),
        ("warm-up", "[OPTIONS]"),
    ],
)
def test_usage_is_written_as_people_type_it(command: str, usage: str, capsys: pytest.CaptureFixture[str]) -> None:
    main.run([command, "-h"])
    assert capsys.readouterr().out.splitlines()[0] == f"Usage: bimvox {command} {usage}"


@pytest.mark.parametrize("command", [name for name in DEEP_COMMANDS if name != "schema"])
def test_every_command_takes_v(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    main.run([*command.split(), "-h"])
    assert "-v, --verbose" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["plan", "a.toml", "--seed", "x"], "error: invalid value for '--seed': not a whole number\n"),
        (["train", "a.toml", "--budget", "x"], "error: invalid value for '--budget': not a number\n"),
    ],
)
def test_a_wrong_number_is_called_so(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(arguments) == 2
    assert capsys.readouterr().err.startswith(said)


@pytest.mark.slow
def test_v_prints_the_stages_on_stderr(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    frame = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
    command = ["voxelize", str(frame), "--voxel-size", "0.5", "-o", str(tmp_path / "grid.zarr.zip"), "--json"]
    assert main.run(command) == 0
    quiet_err = capsys.readouterr().err
    assert main.run([*command, "-v"]) == 0
    out, err = capsys.readouterr()
    stages = dict(re.findall(r"^(\w[\w ]*): (\d+\.\d) s$", err, re.M))
    assert {"read", "voxelize", "write"} <= set(stages)
    assert set(stages) == set(json.loads(out)["seconds"])
    assert " s\n" not in quiet_err


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("bimvox ")


def test_no_command_shows_the_help_and_is_bad_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run([]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Commands:" in err


def test_a_misspelt_command_is_suggested(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["voxelise", "x.ifc"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: no such command 'voxelise'. Did you mean 'voxelize'?")


def test_a_misspelt_option_is_suggested(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["voxelize", "x.ifc", "--voxel-sise", "1"]) == 2
    assert "--voxel-size" in capsys.readouterr().err


def test_bad_usage_with_json_is_a_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["voxelize", "--json"]) == 2
    out, err = capsys.readouterr()
    error = json.loads(out)["error"]
    assert error["code"] == "usage"
    assert "MODEL" in error["message"]
    assert err.startswith("error: ")


def test_json_can_be_requested_by_environment(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BIMVOX_JSON", "1")
    assert main.run(["inspect", "no-such.mcap"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["exit_code"] == 2


def test_an_option_can_be_given_by_environment(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BIMVOX_VOXEL_SIZE", "-3")
    assert main.run(["voxelize", "x.ifc"]) == 2
    assert "BIMVOX_VOXEL_SIZE" in capsys.readouterr().err


def test_interrupting_says_so(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_args: object, **_options: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bimvox_pipeline.schema.schema", interrupt)
    assert main.run(["schema", "site"]) == 130
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: interrupted")


def test_an_internal_error_is_one_line_unless_debugging(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_args: object, **_options: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("bimvox_pipeline.schema.schema", fail)
    monkeypatch.delenv("BIMVOX_DEBUG", raising=False)
    assert main.run(["schema", "site"]) == 70
    err = capsys.readouterr().err
    assert err.startswith("error: sorry, bimvox failed: ZeroDivisionError: division by zero\n")
    assert "Traceback" not in err
    monkeypatch.setenv("BIMVOX_DEBUG", "1")
    assert main.run(["schema", "site"]) == 70
    assert "Traceback" in capsys.readouterr().err
    monkeypatch.delenv("BIMVOX_DEBUG")
    monkeypatch.setattr("bimvox_pipeline.policy.list_policies", fail)
    assert main.run(["policy", "list", "-v"]) == 70
    assert "Traceback" in capsys.readouterr().err


def test_the_reader_of_a_pipe_may_leave() -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [
                sys.executable,
                "-c",
                "import sys; from bimvox_cli.main import run; sys.exit(run(['schema', 'score']))",
            ],
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        os.close(write)
    assert done.stderr == ""


def test_termination_removes_the_temporary_file(tmp_path: Path) -> None:
    code = f"""
import os, pathlib, signal, sys
import bimvox_pipeline.schema
from bimvox_cli.main import run
from bimvox.files import write_atomically

def write_for_ever(stream):
    stream.write(b"half")
    os.kill(os.getpid(), signal.SIGTERM)

out = pathlib.Path({str(tmp_path)!r}) / "out"
bimvox_pipeline.schema.schema = lambda name, **options: write_atomically(out, write_for_ever)
sys.exit(run(["schema", "site"]))
"""
    done = run_python(code)
    assert done.returncode == 128 + signal.SIGTERM
    assert list(tmp_path.iterdir()) == []


def test_the_package_is_the_command_where_no_script_is_on_the_path() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "bimvox_cli", "schema", "nosuch"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "nosuch" in done.stderr
    assert done.stderr.count("\n") < 12


def test_termination_that_a_library_swallows_is_no_fault() -> None:
    code = """
import os, signal, sys
import bimvox_pipeline.schema
from bimvox_cli.main import run

def swallow(name, **options):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except SystemExit:
        raise RuntimeError("compiling failed") from None

bimvox_pipeline.schema.schema = swallow
sys.exit(run(["schema", "site"]))
"""
    done = run_python(code)
    assert done.returncode == 128 + signal.SIGTERM
    assert "failed" not in done.stderr
