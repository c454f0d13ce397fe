"""A soak test of ``bimvox watch``: many random changes of its file, and everything that can go wrong with them.

``make soak-watch``: the command runs in a separate process on the sample frame while this one changes its file. There
are good changes (written in place, by renaming, or after a deletion), broken and half-written content, wrong time
stamps, a full disk (by ``RLIMIT_FSIZE``), and ``kill -9`` at any moment with a restart. Checked:

- every good content leads to a revision, and no reported revision is lost;
- revisions on disk have no gaps;
- the newest plan on disk, combined from the whole log and the segments after it, is for the last reported obstructions,
  and the whole proof accepts it;
- memory does not grow.

The exit code is 1 if a check fails.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from collections import Counter, deque
from pathlib import Path
from typing import Any

from benchmarks.watch_changes import RandomObstructions

SAMPLE = Path(__file__).parents[1] / "sample_models" / "frame.ifc"
SITE, LOG = "soak.site.toml", "soak.mcap"
_WAIT_S = 180.0
_CHECK_EVERY = 50
_BROKEN = (b"", b"{", b'{"version": 1}', b"\xff\xfe\x00", b'{"version": 1, "unit": "m", "obstructions": [{"id": 1}]}')
_KINDS = {
    "write": 50,
    "rename": 20,
    "recreate": 6,
    "broken": 10,
    "halves": 6,
    "stamps": 3,
    "full": 3,
    "kill": 5,
    "idle": 1,
}
_TOLD = ("planned", "replanned", "continued", "unchanged")


class Watch:
    """The command, run as a process.

    Args:
        folder: Holds the site, the log and the obstruction file.
        more: Other options of the command.
    """

    def __init__(self, folder: Path, more: tuple[str, ...] = ()) -> None:
        self._folder = folder
        self.said: queue.Queue[dict[str, Any]] = queue.Queue()
        command = [
            "watch",
            "obstructions.json",
            "--site",
            SITE,
            "-o",
            LOG,
            "--steps",
            "2000",
            "--json",
            *more,
        ]
        self.process = subprocess.Popen(
            [sys.executable, "-c", "from bimvox_cli.main import run; run()", *command],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            preexec_fn=_hear_interrupts,
            env=os.environ
            | {"BIMVOX_POLICIES": str(folder / "policies"), "PYTHONPATH": str(Path(__file__).parents[1])},
        )
        self.notes: deque[bytes] = deque(maxlen=50)
        self.heard: deque[dict[str, Any]] = deque(maxlen=3)
        threading.Thread(target=self._listen, daemon=True).start()
        threading.Thread(target=self._take_notes, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.put(json.loads(line))

    def _take_notes(self) -> None:
        assert self.process.stderr is not None
        self.notes.extend(self.process.stderr)

    def hear(self, *events: str, limit_s: float = _WAIT_S) -> dict[str, Any]:
        """Return the next document of one of these events after which no lifts are pending; skip the others."""
        until_s = time.monotonic() + limit_s
        while True:
            document = self.said.get(timeout=max(0.01, until_s - time.monotonic()))
            if document["event"] != "state":
                self.heard.append(document)
            waits = document.get("pending") and not (document.get("stopped") or {}).get("held")
            if document["event"] in events and not waits:
                return document

    def last_words(self) -> str:
        """Return its last output, shortened."""
        keys = ("event", "revision", "error", "message", "pending", "stopped", "time_s")
        heard = [{key: one[key] for key in keys if key in one} for one in self.heard]
        return f"{heard}, {list(self.notes)[-3:]}"

    def memory_mb(self) -> float:
        """Return the resident memory."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024.0
        return 0.0

    def limit_files(self, size: int) -> None:
        """Limit the length of the files that the process writes; -1 for no limit."""
        resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    def kill(self) -> None:
        """Kill it."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def interrupt(self) -> int:
        """Stop it as a user does, and return its exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=_WAIT_S)


class Soak:
    """The soak test; collects failures.

    Args:
        folder: An empty folder.
        seed: Chooses the changes.
        more: Other options of the command.
        site: A site file with its model in the same folder; None for the sample frame.
    """

    def __init__(self, folder: Path, seed: int, more: tuple[str, ...] = (), site: Path | None = None) -> None:
        from bimvox_pipeline.site import init

        from bimvox.progress import SilentProgress

        self.folder, self.file = folder, folder / "obstructions.json"
        if site is None:
            shutil.copy(SAMPLE, folder)
            init(folder / SAMPLE.name, folder / SITE, voxel_size_m=0.5, progress=SilentProgress())
        else:
            model = Path(tomllib.loads(site.read_text())["model"]["path"])
            shutil.copy(site.parent / model, folder / model.name)
            shutil.copy(site, folder / SITE)
        self.random = random.Random(seed)
        self.wrong: list[str] = []
        self.did: Counter[str] = Counter()
        self.stopped: Counter[str] = Counter()
        self.latencies_ms: list[float] = []
        self.memory_mb: list[float] = []
        self.told = -1
        self.content = b'{"version": 1, "unit": "m", "obstructions": []}'
        self.file.write_bytes(self.content)
        self.more = more
        self.watch = Watch(folder, more)
        self._note(self.watch.hear(*_TOLD, limit_s=1800.0))
        self._wait_until_ready()
        self.changes = RandomObstructions(self._newest().plan, seed)
        self.proofs = self.held = 0

    def run(self, count: int) -> None:
        """Make a number of changes."""
        kinds, weights = list(_KINDS), list(_KINDS.values())
        for number in range(count):
            kind = self.random.choices(kinds, weights)[0]
            self.did[kind] += 1
            try:
                getattr(self, kind)()
            except queue.Empty:
                self._expect(False, f"change {number} ({kind}): no answer; {self.watch.last_words()}")
                self._restart()
            self.memory_mb.append(self.watch.memory_mb())
            if number % _CHECK_EVERY == _CHECK_EVERY - 1 or number == count - 1:
                self.check(f"change {number}")
                print(
                    f"{number + 1} of {count}: {dict(self.did)}, wrong {len(self.wrong)}", file=sys.stderr, flush=True
                )

    def write(self) -> None:
        """Write in place."""
        self.content = self.changes.change()
        self.file.write_bytes(self.content)
        self._answer()

    def rename(self) -> None:
        """Replace by renaming, as editors do."""
        self.content = self.changes.change()
        new = self.folder / "new.json"
        new.write_bytes(self.content)
        new.replace(self.file)
        self._answer()

    def recreate(self) -> None:
        """Delete and create again."""
        self.file.unlink()
        self.watch.hear("missing")
        self.write()

    def broken(self) -> None:
        """Write unusable content, then usable content."""
        self.file.write_bytes(self.random.choice(_BROKEN))
        self.watch.hear("rejected")
        if self.random.random() < 0.5:
            self.file.write_bytes(self.content)
            self._answer()
        else:
            self.write()

    def halves(self) -> None:
        """Write in two halves."""
        self.content = self.changes.change()
        half = len(self.content) // 2
        with self.file.open("wb", buffering=0) as stream:
            stream.write(self.content[:half])
            time.sleep(self.random.uniform(0.0, 0.1))
            stream.write(self.content[half:])
        self._answer()

    def stamps(self) -> None:
        """Set the time stamp hours off."""
        self.content = self.changes.change()
        self.file.write_bytes(self.content)
        hours = self.random.uniform(-48.0, 48.0)
        os.utime(self.file, (time.time() + 3600.0 * hours,) * 2)
        self._answer()

    def full(self) -> None:
        """Leave no disk space for the segment, then restore it."""
        self.watch.limit_files(1000)
        self.content = self.changes.change()
        self.file.write_bytes(self.content)
        answer = self.watch.hear("failed", *_TOLD)
        self.watch.limit_files(-1)
        if answer["event"] == "failed":
            self._answer()
        else:
            self._note(answer)

    def kill(self) -> None:
        """Change the file and kill the process at any moment after that."""
        self.content = self.changes.change()
        self.file.write_bytes(self.content)
        time.sleep(self.random.uniform(0.0, 0.4))
        self._restart()

    def idle(self) -> None:
        """Wait until the whole log is written."""
        time.sleep(3.0)

    def check(self, when: str) -> None:
        """Prove the newest plan on disk, compare it with the reports, and remove segments that are not needed."""
        from bimvox_pipeline.watch.log import segments_on_disk

        from bimvox.library.site import load_obstructions, rasterise, survey_in
        from bimvox.log.reader import read_log
        from bimvox.log.segments import pending_of
        from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
        from bimvox.site.build import with_obstructions

        log = self._newest()
        if pending_of(log):
            self.held += 1  # a load is held on the hook, and later lifts wait
        else:
            self.proofs += 1
            for proof in (
                verify_plan_over_time(log.plan, log.motions),
                verify_motions_over_time(log.plan, log.motions),
            ):
                self._expect(proof.verified, f"{when}: not proven: {proof.failures[:2]}")
        wanted = with_obstructions(
            log.plan.site, load_obstructions(self.file, log.plan.site, survey_in(log)), rasterise
        )
        self._expect(wanted.digest == log.plan.site.digest, f"{when}: the plan on disk is for other obstructions")
        self._expect(log.revision >= self.told, f"{when}: revision {self.told} was reported, {log.revision} is on disk")
        segments = segments_on_disk(self.folder / LOG)
        on_disk = list(segments)
        if on_disk:
            follow = on_disk == list(range(on_disk[0], on_disk[-1] + 1))
            self._expect(follow, f"{when}: a revision is missing: {on_disk}")
        whole = read_log(self.folder / LOG).revision
        for revision, path in segments.items():
            if revision < whole:
                path.unlink()

    def end(self) -> None:
        """Stop as a user does: exit code 0, and the whole log is the newest plan."""
        code = self.watch.interrupt()
        self._expect(code == 0, f"Ctrl-C: exit code {code}")
        log = self._newest()
        self._expect(
            log.revision == self.told, f"after Ctrl-C the newest log is of revision {log.revision}, not {self.told}"
        )
        left = [path.name for path in self.folder.glob(".bimvox-*.part")]
        self._expect(len(left) <= self.did["kill"], f"temporary files left: {left}")

    def _answer(self) -> None:
        self._note(self.watch.hear(*_TOLD))

    def _note(self, document: dict[str, Any]) -> None:
        if stopped := document.get("stopped"):
            self.stopped[stopped["how"] + (", held" if stopped["held"] else "")] += 1
        if document["event"] == "replanned":
            self.latencies_ms.append(document["latency_ms"])
        self._expect(document["revision"] >= self.told, f"revision {document['revision']} after {self.told}")
        self.told = document["revision"]

    def _restart(self) -> None:
        self.watch.kill()
        self.watch = Watch(self.folder, self.more)
        self._note(self.watch.hear(*_TOLD, limit_s=600.0))
        self._wait_until_ready()

    def _wait_until_ready(self) -> None:
        """Pause after the start, because memory is compared from here on."""
        time.sleep(0.2)

    def _newest(self) -> Any:
        from bimvox_pipeline.watch.log import read_newest

        from bimvox.log.reader import read_log
        from bimvox.progress import SilentProgress

        fixed = read_log(self.folder / LOG).plan.site.fixed_digest
        found = read_newest(self.folder / LOG, fixed, SilentProgress())
        assert found is not None
        return found.log

    def _expect(self, good: bool, message: str) -> None:
        if not good:
            self.wrong.append(message)
            print(f"WRONG: {message}", file=sys.stderr, flush=True)


def _hear_interrupts() -> None:
    """Enable Ctrl-C in the command: a soak started in the background of a shell ignores it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def main() -> int:
    """Run the soak test and print the result."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--changes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--site", type=Path, help="a site file, its model in the same folder; default: the sample frame"
    )
    parser.add_argument("--simulate", metavar="SPEED", help="execute the plan meanwhile, SPEED times as fast")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="bimvox-soak-watch-") as folder:
        more = () if options.simulate is None else ("--simulate", options.simulate)
        soak = Soak(Path(folder), options.seed, more, options.site)
        try:
            soak.run(options.changes)
        except KeyboardInterrupt:
            print("ended early", file=sys.stderr)
        soak.end()
        memory = soak.memory_mb
        tenth = max(1, len(memory) // 10)
        ordered = sorted(soak.latencies_ms)
        print(f"changes: {sum(soak.did.values())} ({', '.join(f'{n} {kind}' for kind, n in soak.did.items())})")
        print(f"revisions: {soak.told + 1}; whole proofs of the newest plan: {soak.proofs}; wrong: {len(soak.wrong)}")
        if soak.stopped:
            print(f"stops: {', '.join(f'{n} {how}' for how, n in soak.stopped.items())}; held at {soak.held} proofs")
        high = ordered[int(0.95 * len(ordered))]
        print(f"latency: median {ordered[len(ordered) // 2]:.0f} ms, 95 % below {high:.0f} ms")
        print(f"memory: {max(memory[:tenth]):.0f} MB in the first tenth, {max(memory[-tenth:]):.0f} MB in the last")
        for message in soak.wrong:
            print(f"- {message}")
    return int(bool(soak.wrong))


if __name__ == "__main__":
    sys.exit(main())
