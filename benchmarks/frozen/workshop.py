"""Runs the program in private folders with private policy stores, and keeps the results."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

PROGRAM = (sys.executable, "-m", "bimvox_cli")
"""How the program is started."""
ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_models"

FRAMES = ("frame", "frame_ifc2x3_mm", "frame_georeferenced")
MODELS = {
    **{name: f"{name}.ifc" for name in ("paper", *FRAMES, "hall", "prefab")},
    "yard": "yard.glb",
    "yard_stl": "yard.stl",
}
"""The model of every sample site."""

_STORE_VARIABLE = "BIMVOX_POLICIES"
_OURS = "BIMVOX_"


class RunError(Exception):
    """The program failed."""


class Workshop:
    """Runs the program in separate folders, so that its output contains no path of this machine.

    Args:
        folder: The root of all these folders.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._locks: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)
        self._made: dict[str, Path] = {}

    def fresh(self, name: str) -> Path:
        """Return a new folder."""
        path = self.folder / name
        path.mkdir(parents=True)
        return path

    def run(self, folder: Path, *arguments: str, store: str = "store", codes: Sequence[int] = (0,)) -> str:
        """Run the program in a folder and return what it prints on stdout.

        Args:
            folder: The working folder.
            arguments: Its arguments.
            store: The policy store, by its name.
            codes: Expected exit codes.

        Raises:
            RunError: If the exit code is not expected.
        """
        return self.start([*PROGRAM, *arguments], folder, store, codes)

    def start(self, command: Sequence[str], folder: Path, store: str = "store", codes: Sequence[int] = (0,)) -> str:
        """Run any command as ``run`` does."""
        done = subprocess.run(
            command, cwd=folder, env=self._environment(store), capture_output=True, text=True, check=False
        )
        if done.returncode not in codes:
            raise RunError(f"{' '.join(command[1:])}: exit {done.returncode}\n{done.stderr.strip()}")
        return done.stdout

    def documents(self, folder: Path, *arguments: str, store: str = "store", codes: Sequence[int] = (0,)) -> list[Any]:
        """Run the program with ``--json`` and return the documents that it prints."""
        text = self.run(folder, *arguments, "--json", "-q", store=store, codes=codes)
        decoder, found = json.JSONDecoder(), []
        while text := text.lstrip():
            document, end = decoder.raw_decode(text)
            found.append(document)
            text = text[end:]
        return found

    def once(self, name: str, make: Callable[[Path], None]) -> Path:
        """Return a folder, filled by ``make`` the first time and not changed afterwards."""
        with self._locks[name]:
            if name not in self._made:
                folder = self.fresh(f"once/{name}")
                make(folder)
                self._made[name] = folder
            return self._made[name]

    def begun(self, name: str) -> Path:
        """Return the folder of a sample model and the site file that ``init`` makes of it, ``NAME.site.toml``."""

        def make(folder: Path) -> None:
            shutil.copy(SAMPLES / MODELS[name], folder)
            self.run(folder, "init", MODELS[name], "-o", f"{name}.site.toml", "-q")

        return self.once(f"init-{name}", make)

    def site(self, name: str) -> Path:
        """Return the folder of a sample site: its model, and ``NAME.site.toml``, written by hand or by ``init``."""
        by_hand = SAMPLES / f"{name}.site.toml"

        def make(folder: Path) -> None:
            shutil.copy(SAMPLES / MODELS[name], folder)
            shutil.copy(by_hand, folder)

        return self.once(f"site-{name}", make) if by_hand.exists() else self.begun(name)

    def copy_of(self, source: Path, name: str) -> Path:
        """Return a new folder with the files of another one."""
        folder = self.fresh(name)
        for path in source.iterdir():
            shutil.copy(path, folder)
        return folder

    def planned(self, name: str, *, search: bool) -> Path:
        """Return the folder of a sample site with its log, ``NAME.mcap``, and the plan's document, ``NAME.plan.json``.

        Args:
            name: The site.
            search: By search alone; otherwise with the shipped policy and a separate policy store for the model.
        """

        def make(folder: Path) -> None:
            for path in self.site(name).iterdir():
                shutil.copy(path, folder)
            chosen = ("--policy", "none") if search else ()
            (document,) = self.documents(
                folder, "plan", f"{name}.site.toml", "-o", f"{name}.mcap", *chosen, store=store_of(name)
            )
            (folder / f"{name}.plan.json").write_text(json.dumps(document))

        if not search and name in FRAMES[1:]:
            self.planned(FRAMES[0], search=False)  # the frame's dialects use its policy
        return self.once(f"{'search' if search else 'policy'}-{name}", make)

    def _environment(self, store: str) -> dict[str, str]:
        kept = {key: value for key, value in os.environ.items() if not key.startswith(_OURS)}
        own = {_STORE_VARIABLE: str(self.folder / "stores" / store), "PYTHONPATH": str(ROOT)}
        return kept | own | {"COLUMNS": "120", "NO_COLOR": "1", "TZ": "UTC"}


def store_of(name: str) -> str:
    """Return the policy store of a sample site: the frame's dialects share one."""
    return FRAMES[0] if name in FRAMES else name
