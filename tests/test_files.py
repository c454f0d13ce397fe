import errno
import hashlib
import io
import os
import sys
from pathlib import Path
from typing import BinaryIO

import pytest

from bimvox.errors import FileError, InputError
from bimvox.files import (
    check_folder,
    check_new_folder,
    check_output,
    default_output,
    kept_to,
    put_in_place,
    read_input,
    reason_of,
    require_input,
    resolved,
    scratch_folder,
    sha256_of,
    write_atomically,
    write_together,
    written_aside,
)


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_writes_bytes_and_what_a_function_writes(tmp_path: Path) -> None:
    write_atomically(tmp_path / "a", b"one")
    write_atomically(tmp_path / "b", lambda stream: stream.writelines([b"t", b"wo"]))
    assert (tmp_path / "a").read_bytes() == b"one"
    assert (tmp_path / "b").read_bytes() == b"two"
    assert names(tmp_path) == ["a", "b"]


def test_new_files_get_the_ordinary_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").write_bytes(b"")
    write_atomically(tmp_path / "ours", b"")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, RuntimeError, InputError])
def test_an_interruption_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, interruption: type[BaseException]
) -> None:
    target = tmp_path / "log"
    target.write_bytes(b"old")

    def write_half(stream: BinaryIO) -> None:
        stream.write(b"half of it")
        raise interruption("stop")

    with pytest.raises(interruption):
        write_atomically(target, write_half)
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["log"]


def test_a_full_disk_is_reported_and_cleaned_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class FullDisk(io.FileIO):
        def write(self, _data: object) -> int:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fdopen", lambda descriptor, mode: FullDisk(descriptor, mode))
    with pytest.raises(FileError, match="no space left on device") as caught:
        write_atomically(tmp_path / "grid", b"data")
    assert caught.value.hint is not None
    assert "free some space" in caught.value.hint
    assert names(tmp_path) == []


def test_a_failing_sync_is_reported_and_cleaned_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_descriptor: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(FileError, match="input/output error"):
        write_atomically(tmp_path / "grid", b"data")
    assert names(tmp_path) == []


def test_an_input_is_never_overwritten(tmp_path: Path) -> None:
    source = tmp_path / "model.ifc"
    source.write_bytes(b"precious")
    (tmp_path / "link.ifc").symlink_to(source)
    os.link(source, tmp_path / "hard.ifc")
    for output in (source, tmp_path / "link.ifc", tmp_path / "hard.ifc", tmp_path / "." / "model.ifc"):
        with pytest.raises(FileError, match="overwrite its own input"):
            write_atomically(output, b"grid", inputs=[source])
    assert source.read_bytes() == b"precious"


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to("real")
    write_atomically(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_impossible_outputs(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="does not exist"):
        check_output(tmp_path / "no" / "such" / "grid")
    with pytest.raises(FileError, match="this is a folder"):
        check_output(tmp_path)
    with pytest.raises(FileError, match="not a regular file"):
        check_output(Path(os.devnull))
    (tmp_path / "file").write_bytes(b"x")
    with pytest.raises(FileError, match="does not exist"):
        check_output(tmp_path / "file" / "grid")


def test_an_unwritable_folder_is_reported_before_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    with pytest.raises(FileError, match="cannot be written to"):
        check_output(tmp_path / "grid")


def test_impossible_inputs(tmp_path: Path) -> None:
    (tmp_path / "house.ifc").write_bytes(b"x")
    (tmp_path / "empty.ifc").write_bytes(b"")
    assert require_input(tmp_path / "house.ifc") == tmp_path / "house.ifc"
    with pytest.raises(FileError, match="no such file") as caught:
        require_input(tmp_path / "hose.ifc")
    assert caught.value.hint == f"did you mean {tmp_path / 'house.ifc'}?"
    with pytest.raises(FileError, match="empty"):
        require_input(tmp_path / "empty.ifc")
    with pytest.raises(FileError, match="folder"):
        require_input(tmp_path)


def test_digest_is_of_the_bytes(tmp_path: Path) -> None:
    data = bytes(range(256)) * 9000
    (tmp_path / "x").write_bytes(data)
    assert sha256_of(tmp_path / "x") == hashlib.sha256(data).hexdigest()
    with pytest.raises(FileError, match="cannot be read"):
        sha256_of(tmp_path / "missing")


@pytest.mark.parametrize(
    ("source", "suffix", "expected"),
    [
        ("models/house.ifc", ".zarr.zip", "house.zarr.zip"),
        ("models/house.ifc", ".site.toml", "house.site.toml"),
        ("house.site.toml", ".mcap", "house.mcap"),
        ("HOUSE.Site.toml", ".mcap", "HOUSE.mcap"),
        ("house.zarr.zip", ".vti", "house.vti"),
        ("house", ".mcap", "house.mcap"),
        ("house.v2.stl", ".mcap", "house.v2.mcap"),
        (".site.toml", ".mcap", ".site.mcap"),
    ],
)
def test_default_output_drops_our_suffixes(source: str, suffix: str, expected: str) -> None:
    assert default_output(Path(source), suffix) == Path(expected)


@pytest.mark.parametrize("failing", [0, 1])
def test_of_several_files_all_or_none_take_their_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    first.write_bytes(b"old")
    replace = Path.replace

    def fail_once(path: Path, target: Path) -> Path:
        if target == (first, second)[failing] and path.suffix == ".part":
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return replace(path, target)

    with monkeypatch.context() as once:
        once.setattr(Path, "replace", fail_once)
        with pytest.raises(FileError, match="nothing was changed"):
            write_together({first: b"1", second: b"2"})
    assert (names(tmp_path), first.read_bytes()) == (["a.csv"], b"old")
    write_together({first: b"1", second: b"2"})
    assert (names(tmp_path), first.read_bytes(), second.read_bytes()) == (["a.csv", "b.csv"], b"1", b"2")


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_a_thread_that_is_kept_to_a_folder_touches_no_file_outside(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    for folder in (inside, outside):
        folder.mkdir()
        (folder / "a").write_bytes(b"one")
    (inside / "to file").symlink_to(outside / "a")
    (inside / "to nothing").symlink_to(outside / "new")
    (inside / "sub").symlink_to(outside)
    (inside / "own").symlink_to(inside / "a")
    ways_out = [outside / "a", inside / "../outside/a", inside / "to file", inside / "to nothing", inside / "sub" / "a"]
    with kept_to(inside):
        for path in ways_out:
            for act in (read_input, require_input, check_output, lambda path: write_atomically(path, b"two")):
                with pytest.raises(FileError, match="leads out of the folder"):
                    act(path)  # type: ignore[operator]
        write_atomically(inside / "own", b"two")
        assert read_input(inside / "a") == b"two"
        aside = written_aside(inside / "new", b"three")
        (inside / "new").symlink_to(outside / "new")  # after it was looked at
        with pytest.raises(FileError, match="leads out"):
            put_in_place(aside, inside / "new")
        with scratch_folder() as scratch:
            write_atomically(scratch / "b", b"four")
            with pytest.raises(FileError, match="leads out"):
                read_input(inside / "a")
    assert read_input(outside / "a") == b"one"
    assert names(outside) == ["a"]
    assert not [name for name in names(inside) if name.endswith(".part")]


@pytest.mark.skipif(not Path("/proc/kmsg").exists(), reason="needs /proc")
@pytest.mark.parametrize("name", ["/proc/kmsg", "/proc/self/mem", "/proc/self/environ", "link"])
def test_a_view_into_the_system_is_not_read(name: str, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("/proc/kmsg")
    for read in (require_input, read_input):
        with pytest.raises(FileError, match="a view into the system, not a regular file"):
            read(tmp_path / name)


@pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be deleted")
def test_a_deleted_current_folder_is_called_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    (tmp_path / "there").write_bytes(b"x")
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    acts = (
        require_input,
        read_input,
        check_output,
        lambda path: write_atomically(path, b""),
        resolved,
        check_new_folder,
        check_folder,
    )
    for act in acts:
        with pytest.raises(FileError, match="the current folder has been deleted"):
            act(Path("file"))
    with pytest.raises(FileNotFoundError) as caught:
        Path("folder").mkdir()
    assert reason_of(caught.value) == "the current folder has been deleted"
    assert read_input(tmp_path / "there") == b"x"


def test_a_folder_for_outputs_is_checked_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"x")
    assert check_folder(tmp_path) == tmp_path
    assert check_folder(tmp_path / "new" / "deeper") == tmp_path / "new" / "deeper"
    assert not (tmp_path / "new").exists()
    for path in (tmp_path / "file", tmp_path / "file" / "new", Path(os.devnull)):
        with pytest.raises(FileError, match="not a folder"):
            check_folder(path)
