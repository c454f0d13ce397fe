"""Policies as single files: ours, to share; ONNX, for controllers; stable-baselines3's, for researchers."""

from __future__ import annotations

import hashlib
import importlib
import io
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError, MissingPackageError, PolicyError
from bimvox.extras import require
from bimvox.files import check_output, read_input, write_atomically
from bimvox.grid.layout import BROKEN_ZIP, write_archive

if TYPE_CHECKING:
    from bimvox.planning.rollout import TowardsTarget, Values
    from bimvox.policy.manifest import PolicyManifest
    from bimvox.policy.store import StoredPolicy
    from bimvox.progress import Progress


def pack(files: dict[str, bytes]) -> bytes:
    """Return files as the bytes of a zip; the same files give the same bytes."""
    buffer = io.BytesIO()
    write_archive(buffer, sorted(files.items()))
    return buffer.getvalue()


def unpack(content: bytes, names: tuple[str, ...], largest_bytes: int) -> dict[str, bytes]:
    """Return the files of a zip of :func:`pack`, which must hold these and no others.

    Raises:
        PolicyError: It is not such a zip, a file in it is too large, or it is damaged.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            held = sorted(info.filename for info in archive.infolist())
            if held != sorted(names):
                shown = ", ".join(held[:5]) or "nothing"
                raise PolicyError(
                    f"holds {shown}, not {' and '.join(sorted(names))}",
                    differs={"files": (held, sorted(names))},
                    hint="a file of `bimvox policy export` is needed; for one of stable-baselines3 add --trust",
                )
            for info in archive.infolist():
                if info.file_size > largest_bytes:
                    raise PolicyError(f"{info.filename}: {info.file_size:,} bytes, more than a policy can have")
            return {name: archive.read(name) for name in names}
    except BROKEN_ZIP as error:
        raise PolicyError(f"not a whole zip file: {error}", hint="copy or export it again") from error


_FORMATS = {"bimvox": ".policy.zip", "onnx": ".onnx", "sb3": ".sb3.zip"}
"""The formats, with the default suffix of their files."""

_SB3_MEMBER = "policy.pth"
_SB3_FILE = "a file of stable-baselines3"


def export_policy(policy_id: str, *, to: str | None = None, out: Path | None = None) -> dict[str, Any]:
    """Write a policy of the store to a file, and return the document of ``bimvox policy export --json``.

    Args:
        policy_id: Its id, or the beginning of it.
        to: A key of ``_FORMATS``; default: by the suffix of ``out``, otherwise ``bimvox``.
        out: The file; default: the id, in the current folder.

    Raises:
        PolicyError: If there is no such policy, it is damaged, or a package for the format is missing.
        InputError: If the format is unknown or the file cannot be written.
    """
    from bimvox.policy import store

    form = to or _form_by_name(out)
    if form not in _FORMATS:
        raise InputError(f"--to {form}: there is no such format of a policy", hint=f"one of {', '.join(_FORMATS)}")
    found = store.load(policy_id)
    target = out or Path(f"{found.manifest.id}{_FORMATS[form]}")
    check_output(target)
    write_atomically(target, _bytes(found, form))
    return {"id": found.manifest.id, "out": str(target), "format": form}


def import_policy(source: Path, *, trust: bool = False) -> dict[str, Any]:
    """Put a policy from a file into the store, and return the document of ``bimvox policy import --json``.

    Args:
        source: A file of :func:`export_policy`, or with ``trust`` a zip of stable-baselines3's DQN.
        trust: Accept a file without a manifest; only its tensors are read, and no code in it runs.

    Raises:
        PolicyError: If it is not a policy, is damaged, or does not fit this version.
    """
    from bimvox.policy import store

    content = read_input(source, most_bytes=2 * store.LARGEST_FILE_BYTES)
    try:
        if _is_sb3(content):
            identity = _from_sb3(content, trust)
        else:
            files = unpack(content, (store.MANIFEST_FILE, store.WEIGHTS_FILE), store.LARGEST_FILE_BYTES)
            identity = store.add(files)
    except PolicyError as error:
        raise PolicyError(f"{source}: {error.message}", differs=error.differs, hint=error.hint) from error
    return {"id": identity, "store": str(store.store_folder()), "imported": str(source)}


def _form_by_name(out: Path | None) -> str:
    if out is None:
        return "bimvox"
    fitting = [form for form, end in _FORMATS.items() if out.name.lower().endswith(end)]
    return fitting[0] if fitting else "bimvox"


def _bytes(found: StoredPolicy, form: str) -> bytes:
    from bimvox.policy import store

    if form == "bimvox":
        return pack(store.files_of(found.manifest.id))
    if form == "onnx":
        from bimvox.policy.onnx_file import onnx_bytes

        about = found.manifest
        return onnx_bytes(
            found.network,
            {"policy": about.id, "observation": about.observation, "geometry_key": about.geometry_key},
        )
    require("train", _SB3_FILE)
    from bimvox.policy.sb3_file import write_sb3_zip

    with tempfile.TemporaryDirectory(prefix="bimvox-policy-") as folder:
        written = Path(folder) / "policy.zip"
        write_sb3_zip(found.network, written)
        return written.read_bytes()


def _is_sb3(content: bytes) -> bool:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return _SB3_MEMBER in archive.namelist()
    except (zipfile.BadZipFile, OSError):
        return False


def _from_sb3(content: bytes, trust: bool) -> str:
    if not trust:
        raise PolicyError(
            "this file is from stable-baselines3 and has no manifest to check it against",
            hint="add --trust if you know who made it; only its weights are read, no code in it runs",
        )
    require("train", _SB3_FILE)
    from bimvox.policy import store
    from bimvox.policy.config import DqnConfig
    from bimvox.policy.manifest import TrainedPolicy
    from bimvox.policy.sb3_file import read_sb3_zip

    network = read_sb3_zip(content)
    config = DqnConfig(hidden=network.layer_sizes[1:-1])
    policy = TrainedPolicy(config=config, network=network)
    return store.save(policy, f"imported:{hashlib.sha256(content).hexdigest()}")


# The policy store, as ``bimvox policy`` shows it.


def list_policies() -> dict[str, Any]:
    """Return the store's folder, the policies in it, and the damaged ones with the reason."""
    from bimvox.policy import store

    found = store.scan()
    return {
        "store": str(store.store_folder()),
        "policies": [_summary(manifest) for manifest in found.manifests],
        "damaged": [{"id": name, "reason": reason} for name, reason in found.damaged],
    }


def show(policy_id: str) -> dict[str, Any]:
    """Return the manifest of a policy, after checking its weights.

    Raises:
        PolicyError: If there is no such policy, or it is damaged.
    """
    from bimvox.policy import store

    return {"kind": "policy", **store.load(policy_id).manifest.to_dict()}


def remove(policy_id: str) -> dict[str, Any]:
    """Remove a policy from the store.

    Raises:
        PolicyError: If there is no such policy, or it cannot be removed.
    """
    from bimvox.policy import store

    return {"store": str(store.store_folder()), "removed": store.remove(policy_id)}


def _summary(manifest: PolicyManifest) -> dict[str, Any]:
    of_a_test = ("success_rate", "length_ratio")
    names = ("id", "steps", *of_a_test, "tested", "seed", "parent", "geometry_key")
    return {name: getattr(manifest, name) if manifest.tested or name not in of_a_test else None for name in names}


# The score of a policy from anywhere: the shipped one, a stored one, an ONNX file, a Python function.


def score_policy(policy: str, *, sets: Sequence[str] = (), share: float = 1.0, progress: Progress) -> dict[str, Any]:
    """Score a policy on the frozen held-out suite, and return the document of ``bimvox policy score --json``.

    Args:
        policy: ``default`` (the shipped network), ``greedy``, an id of the store, ``FILE.onnx``, or
            ``module:function``, whose code runs.
        sets: Names of sets; default: all.
        share: Of each set, above 0, at most 1.
        progress: Counts the problems.

    Raises:
        PolicyError: The policy cannot be loaded or fails, or a problem is not the frozen one.
        InputError: There is no such set, or the share is outside 0 to 1.
    """
    from bimvox.policy.score import chosen_sets, score

    if not 0.0 < share <= 1.0:
        raise InputError(f"--share {share:g}: a share is above 0 and at most 1")
    chosen = chosen_sets(sets)
    identity, values = _loaded(policy)
    return score(identity, values, chosen, share, progress).model_dump(mode="json")


def _loaded(policy: str) -> tuple[str, Values | TowardsTarget]:
    """Return what names a policy in a result, and the policy."""
    if policy.lower().endswith(".onnx"):
        return _from_onnx(Path(policy))
    if ":" in policy:
        from bimvox_pipeline.named_code import named_code

        found = named_code(policy, "policy", PolicyError)
        if not callable(found):
            raise PolicyError(f"{policy}: a {type(found).__name__} is not a function")
        return policy, found
    from bimvox.planning.rollout import GREEDY
    from bimvox.policy.choice import DEFAULT_START, GREEDY_POLICY

    if policy == GREEDY_POLICY.id:
        return policy, GREEDY
    if policy == DEFAULT_START:
        from bimvox.policy.generalist.weights import generalist_record, load_generalist

        return str(generalist_record()["id"]), load_generalist()
    from bimvox.policy import store

    found = store.load(policy)
    return found.manifest.id, found.network


def _from_onnx(file: Path) -> tuple[str, Values]:
    content = read_input(file)
    try:
        runtime = importlib.import_module("onnxruntime")
    except ImportError as error:
        raise MissingPackageError("onnxruntime", "scoring an ONNX file") from error
    try:
        session = runtime.InferenceSession(content, providers=["CPUExecutionProvider"])
        (name,) = [one.name for one in session.get_inputs()]
    except Exception as error:  # onnxruntime raises kinds of its own
        raise PolicyError(f"{file}: not an ONNX model with one input") from error
    return hashlib.sha256(content).hexdigest()[:16], lambda observations: session.run(None, {name: observations})[0]
