"""Hostile files through the command line: one sentence and exit code 2, in limited time and memory."""

import io
import json
import os
import signal
import socket
import struct
import time
import zlib
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path

import pytest
import zstandard
from bimvox_cli.main import run
from mcap.writer import CompressionType, Writer

SAMPLES = Path(__file__).parents[2] / "sample_models"
SITE = '[model]\npath = "house.ifc"\n'
_PATIENCE_S = 60


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Return a folder with a model; a test that hangs is interrupted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BIMVOX_POLICIES", str(tmp_path / "policies"))
    Path("house.ifc").write_bytes((SAMPLES / "frame.ifc").read_bytes())

    def hangs(*_: object) -> None:
        raise AssertionError("it hangs")

    previous = signal.signal(signal.SIGALRM, hangs)
    signal.alarm(_PATIENCE_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, previous)


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]):
    """Run a command that must be refused with one sentence, and return that sentence."""

    def run_it(*arguments: str) -> str:
        there = sorted(Path().iterdir())
        code = run(list(arguments))
        out, err = capsys.readouterr()
        assert code == 2, err
        assert out == ""
        assert err.startswith("error: ")
        assert len(err.splitlines()) <= 2
        assert "Traceback" not in err
        assert "Warning" not in err
        assert len(err) < 2000
        assert sorted(Path().iterdir()) == there
        return err

    return run_it


def pipe(name: str) -> None:
    os.mkfifo(name)


def device(name: str) -> None:
    Path(name).symlink_to("/dev/zero")


def folder(name: str) -> None:
    Path(name).mkdir()


def unix_socket(name: str) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(name)


COMMANDS = {
    "voxelize": ("a.ifc", ["voxelize", "a.ifc"]),
    "mesh": ("a.glb", ["voxelize", "a.glb"]),
    "init": ("a.ifc", ["init", "a.ifc"]),
    "inspect": ("a.json", ["inspect", "a.json"]),
    "site": ("a.toml", ["plan", "a.toml"]),
    "obstructions": ("a.json", ["plan", "site.toml", "--obstructions", "a.json"]),
    "scan": ("a.ply", ["plan", "site.toml", "--obstructions", "a.ply"]),
    "log": ("a.mcap", ["verify", "a.mcap"]),
    "export": ("a.mcap", ["export", "a.mcap"]),
    "render": ("a.mcap", ["render", "a.mcap"]),
    "report": ("a.mcap", ["report", "a.mcap"]),
    "sweep": ("a.toml", ["sweep", "a.toml"]),
}


@pytest.mark.parametrize("make", [pipe, device, folder, unix_socket])
@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_not_a_regular_file_is_not_opened(command, make, refused) -> None:
    name, arguments = COMMANDS[command]
    Path("site.toml").write_text(SITE)
    make(name)
    said = refused(*arguments)
    assert name in said
    words = {pipe: "a pipe", device: "a device", folder: "a folder", unix_socket: "a socket"}
    assert words[make] in said


@pytest.mark.parametrize("key", ["mesh", "points"])
@pytest.mark.parametrize("make", [pipe, device])
def test_files_named_in_an_obstruction_file_are_checked_too(key, make, refused) -> None:
    make("a.ply")
    Path("o.json").write_text(json.dumps({"version": 1, "obstructions": [{"id": "a", key: "a.ply"}]}))
    said = refused("inspect", "o.json")
    assert f"obstructions[0].{key}" in said
    assert "not a regular file" in said


@pytest.mark.parametrize("make", [pipe, device])
def test_the_model_of_a_site_is_checked_too(make, refused) -> None:
    make("a.ifc")
    Path("site.toml").write_text('[model]\npath = "a.ifc"\n')
    said = refused("plan", "site.toml")
    assert "not a regular file" in said


def test_the_buffer_of_a_gltf_is_checked_too(refused) -> None:
    pipe("a.bin")
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": "a.bin", "byteLength": 36}],
    }
    Path("a.gltf").write_text(json.dumps(document))
    said = refused("voxelize", "a.gltf")
    assert "buffers[0]" in said
    assert "not a regular file" in said


@pytest.mark.parametrize(("name", "arguments"), [(n, a) for n, a in COMMANDS.values() if not n.endswith(".glb")])
def test_a_huge_file_is_measured_before_it_is_read(name, arguments, refused) -> None:
    Path("site.toml").write_text(SITE)
    with Path(name).open("wb") as stream:
        stream.write(b"\x89MCAP0\r\n" if name.endswith(".mcap") else b"")
        stream.truncate(1 << 40)
    assert name in refused(*arguments)


@pytest.mark.parametrize("command", COMMANDS)
def test_an_impossible_path(command, refused) -> None:
    name, arguments = COMMANDS[command]
    Path("site.toml").write_text(SITE)
    Path(name).symlink_to(name)
    assert "levels of symbolic links" in refused(*arguments)
    long = "a" * 300 + Path(name).suffix
    assert "name too long" in refused(*[long if one == name else one for one in arguments])


@pytest.mark.parametrize("out", ["a" * 300, "loop"])
def test_an_impossible_output(out, refused) -> None:
    Path("loop").symlink_to("loop")
    refused("voxelize", "house.ifc", "-o", out)


def test_a_nul_in_a_path(refused) -> None:
    Path("site.toml").write_text('[model]\npath = "a\\u0000b.ifc"\n')
    assert "model.path" in refused("plan", "site.toml")
    Path("o.json").write_text(json.dumps({"version": 1, "obstructions": [{"id": "a", "mesh": "a\0b.ply"}]}))
    assert "NUL" in refused("inspect", "o.json")


DEEP = 100_000
TEXTS = {
    "lists": f"a = {'[' * DEEP}{']' * DEEP}\n",
    "tables": f"a = {'{a=' * DEEP}1{'}' * DEEP}\n",
    "dotted": f"{'.'.join(['a'] * DEEP)} = 1\n",
    "header": f"[{'.'.join(['a'] * DEEP)}]\n",
    "digits": f"a = {'9' * 5000}\n",
    "many digits": f'[model]\npath = "house.ifc"\nvoxel_size_m = {"9" * 4000}\n',
    "hexadecimal": f"a = 0x{'f' * 5000}\n",
}


@pytest.mark.parametrize("case", TEXTS)
def test_a_site_file_too_deep_or_too_long(case, refused) -> None:
    Path("a.toml").write_text(TEXTS[case])
    refused("plan", "a.toml")
    refused("inspect", "a.toml")
    refused("sweep", "a.toml")


JSON_TEXTS = {
    "lists": "[" * DEEP + "]" * DEEP,
    "unfinished": "[" * DEEP,
    "tables": '{"a":' * DEEP + "1" + "}" * DEEP,
    "moderately deep": '{"obstructions":' * 500 + "1" + "}" * 500,
    "digits": f'{{"version": 1, "obstructions": {"9" * 5000}}}',
    "radius": f'{{"version": 1, "obstructions": [{{"id": "a", "cylinder": {{"radius": {"9" * 4000}}}}}]}}',
    "cell": f'{{"version": 1, "obstructions": [{{"id": "a", "voxels": [[0,0,{"9" * 4000}]]}}]}}',
}


@pytest.mark.parametrize("case", JSON_TEXTS)
def test_an_obstruction_file_too_deep_or_too_long(case, refused) -> None:
    Path("o.json").write_text(JSON_TEXTS[case])
    refused("inspect", "o.json")


@pytest.mark.parametrize(
    "line",
    [
        "[model]\nvoxel_size_m = 1e308",
        "[model]\nvoxel_size_m = 1e-300",
        "[model]\nground_m = -1e9",
        "[model]\nyaw_deg = 1e9",
        "[crane]\nslewing = {rate_rad_s = 1e-12, acceleration_rad_s2 = 0.1, jerk_rad_s3 = 0.1}",
        "[crane]\nhoist = {rate_m_s = 1, acceleration_m_s2 = 1e-12, jerk_m_s3 = 0.1}",
        "[rules]\nclearance_m = 1e308",
        "[rules]\nbracing_s = 1e12",
        "[rules]\nsample_period_s = 1e-12",
    ],
)
def test_a_number_that_no_site_has(line, refused) -> None:
    table, _, rest = line.partition("\n")
    text = f'{table}\npath = "house.ifc"\n{rest}' if table == "[model]" else f"{SITE}{line}"
    Path("a.toml").write_text(text)
    assert rest.split(" = ")[0].split(".")[-1] in refused("plan", "a.toml")


def test_a_name_of_50_megabytes(capsys) -> None:
    Path("o.json").write_text(
        json.dumps({"version": 1, "obstructions": [{"id": "a" * 50_000_000, "box": {"min": [0] * 3, "max": [1] * 3}}]})
    )
    assert run(["inspect", "o.json"]) == 2
    out, err = capsys.readouterr()
    assert len(out) + len(err) < 2000
    assert "obstructions[0].id" in err


@pytest.mark.parametrize(
    "form",
    [{"box": {"min": [-1e308] * 3, "max": [1e308] * 3}}, {"cylinder": {"base": [0] * 3, "radius": 1e300, "height": 1}}],
)
def test_an_obstruction_larger_than_any_site(form, refused) -> None:
    Path("o.json").write_text(json.dumps({"version": 1, "obstructions": [{"id": "a", **form}]}))
    assert "obstructions[0]" in refused("inspect", "o.json")


def test_a_point_farther_than_any_site_is_shown(capsys) -> None:
    Path("a.xyz").write_text("0 0 0\n1e308 0 0\n")
    Path("o.json").write_text(json.dumps({"version": 1, "obstructions": [{"id": "a", "points": "a.xyz"}]}))
    assert run(["inspect", "o.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["obstructions"][0]["high_m"] == [1e308, 0.0, 0.0]


@pytest.mark.parametrize(
    ("name", "data", "arguments"),
    [
        ("a.toml", b"[model\n", ["plan", "a.toml"]),
        ("a.toml", "[model]".encode("utf-16"), ["plan", "a.toml"]),
        ("a.toml", b"sites = [", ["sweep", "a.toml"]),
        ("o.json", b'{"obstructions": [', ["inspect", "o.json"]),
        ("o.json", '{"obstructions": ["é"]}'.encode("latin-1"), ["plan", "site.toml", "--obstructions", "o.json"]),
        ("a.mcap", b"no log", ["verify", "a.mcap"]),
        ("a.mcap", b"no log", ["export", "a.mcap", "--recover", "-o", "b.mcap"]),
    ],
)
def test_a_file_of_another_kind_says_what_to_do(name, data, arguments, refused) -> None:
    Path("site.toml").write_text(SITE)
    Path(name).write_bytes(data)
    assert "hint: " in refused(*arguments)


def test_a_name_of_megabytes_costs_nothing(capsys) -> None:
    Path("a.ifc").write_text(Path("house.ifc").read_text().replace("Column B1", "x" * 3_000_000))
    before_s = time.process_time()
    assert run(["voxelize", "a.ifc", "--voxel-size", "0.5", "--json"]) == 0
    assert time.process_time() - before_s < 4.0
    out = capsys.readouterr().out
    assert len(out) < 20_000
    assert "x" * 500 in out


def test_a_policy_store_that_is_a_file(refused, monkeypatch) -> None:
    Path("store").write_text("x")
    monkeypatch.setenv("BIMVOX_POLICIES", "store")
    assert "BIMVOX_POLICIES" in refused("policy", "list")


@cache
def log_of_zeros(uncompressed: int) -> bytes:
    """Return a small log with a large chunk of zeros."""
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(library="bimvox 1")
    writer.finish()
    empty, zeros = stream.getvalue(), bytes(uncompressed)
    packed, crc = zstandard.ZstdCompressor().compress(zeros), zlib.crc32(zeros)
    body = struct.pack("<QQQI", 0, 0, uncompressed, crc) + b"\x04\0\0\0zstd" + struct.pack("<Q", len(packed)) + packed
    header_end = 8 + 9 + struct.unpack_from("<Q", empty, 9)[0]
    return empty[:header_end] + b"\x06" + struct.pack("<Q", len(body)) + body + empty[header_end:]


@pytest.mark.slow
# What is small enough to be read is read record by record, so that 32 MiB of them take a second.
@pytest.mark.parametrize(
    ("size", "command"),
    [(32 << 20, "verify"), *product((2 << 20, 512 << 20), ("verify", "inspect", "export", "report"))],
)
def test_a_bomb_in_a_log_is_refused_by_its_header(command, size, refused) -> None:
    Path("a.mcap").write_bytes(log_of_zeros(size))
    started_s = time.monotonic()
    assert "a.mcap" in refused(command, "a.mcap")
    assert time.monotonic() - started_s < 10.0
