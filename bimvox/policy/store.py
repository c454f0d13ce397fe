"""The policy store: one plain folder per policy, named by the hash of its content.

::

    <store>/<id>/weights.safetensors    the network's arrays
    <store>/<id>/manifest.json          everything else

The environment variable ``BIMVOX_POLICIES`` names the store's folder; default: ``policies`` in the user's data folder.
Files are safetensors and JSON: reading one runs no code. A folder is written under another name and then renamed, so
that it is never incomplete.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import platformdirs
from safetensors import SafetensorError
from safetensors.numpy import load as arrays_from_bytes
from safetensors.numpy import save as bytes_from_arrays

from bimvox.errors import FileError, PolicyError
from bimvox.files import read_input, status_of
from bimvox.policy.config import DqnConfig
from bimvox.policy.manifest import (
    PolicyManifest,
    SiteOutline,
    TrainedPolicy,
    canonical_json,
    distance,
    id_of,
    is_id,
    manifest_from_dict,
    manifest_of,
    require_fit,
)
from bimvox.policy.network import QNetwork, network_from_arrays

STORE_VARIABLE = "BIMVOX_POLICIES"
WEIGHTS_FILE = "weights.safetensors"
MANIFEST_FILE = "manifest.json"

LARGEST_FILE_BYTES = 64 * 2**20
"""Largest size of a file; a network takes about 1 MB."""

_TEMPORARY = ".writing-"


@dataclass(frozen=True, slots=True, eq=False)
class StoredPolicy:
    """A loaded policy: its manifest, and its weights ready for use."""

    manifest: PolicyManifest
    network: QNetwork

    @property
    def trained(self) -> TrainedPolicy:
        """The policy as its training returned it."""
        return TrainedPolicy(network=self.network, **self.manifest.training())


@dataclass(frozen=True, slots=True)
class StoreScan:
    """The content of a store.

    Attributes:
        manifests: Of all readable policies, ascending id.
        damaged: Folder name and reason of every unreadable one.
    """

    manifests: tuple[PolicyManifest, ...]
    damaged: tuple[tuple[str, str], ...]


def store_folder() -> Path:
    """Return the folder of the store, which may not exist yet.

    Raises:
        PolicyError: If something else than a folder is there.
        FileError: If the path is impossible.
    """
    chosen = os.environ.get(STORE_VARIABLE)
    folder = Path(chosen) if chosen else Path(platformdirs.user_data_dir("bimvox")) / "policies"
    if status_of(folder) is not None and not folder.is_dir():
        raise PolicyError(f"{folder}: the policy store is not a folder", hint=f"set {STORE_VARIABLE} to a folder")
    return folder


def save(
    policy: TrainedPolicy, geometry_key: str, *, site: SiteOutline | None = None, folder: Path | None = None
) -> str:
    """Store a policy and return its id; storing the same one again changes nothing.

    Args:
        policy: The result of training.
        geometry_key: Digest of the site's geometry; empty if the policy belongs to no site.
        site: Outline of that site.
        folder: The store; default: the user's own.

    Raises:
        PolicyError: The folder cannot be written.
    """
    weights = bytes_from_arrays(policy.network.arrays())
    manifest = manifest_of(policy, geometry_key, site, weights)
    files = {WEIGHTS_FILE: weights, MANIFEST_FILE: canonical_json(manifest.to_dict()).encode()}
    return _put(manifest.id, files, folder or store_folder())


def files_of(policy_id: str, *, folder: Path | None = None) -> dict[str, bytes]:
    """Return the files of a policy by name, checked.

    Raises:
        PolicyError: As :func:`load`.
    """
    store = folder or store_folder()
    identity = load(policy_id, folder=store).manifest.id
    return {name: _read(store / identity / name) for name in (MANIFEST_FILE, WEIGHTS_FILE)}


def add(files: Mapping[str, bytes], *, folder: Path | None = None) -> str:
    """Store a policy from the files of :func:`files_of` and return its id.

    Args:
        files: ``manifest.json`` and ``weights.safetensors``; checked as when loading, before anything is stored.
        folder: The store; default: the user's own.

    Raises:
        PolicyError: They are damaged, do not belong together or do not fit this version, or the store cannot be
            written.
    """
    store = folder or store_folder()
    try:
        identity = str(json.loads(files[MANIFEST_FILE].decode())["id"])
    except (ValueError, RecursionError, KeyError, TypeError) as error:
        raise PolicyError(f"{MANIFEST_FILE}: not a manifest: {error}") from error
    if not is_id(identity):
        raise PolicyError(f"{MANIFEST_FILE}: the id is {identity[:40]!r}, not 16 hexadecimal digits")
    with tempfile.TemporaryDirectory(prefix="bimvox-policy-") as checked:
        place = Path(checked) / identity
        place.mkdir()
        for name in (MANIFEST_FILE, WEIGHTS_FILE):
            (place / name).write_bytes(files[name])
        load(identity, folder=Path(checked))
    return _put(identity, files, store)


def _put(identity: str, files: Mapping[str, bytes], store: Path) -> str:
    """Write a policy's folder, completely or not at all."""
    place = store / identity
    if place.exists():
        try:
            load(identity, folder=store)
        except PolicyError:
            shutil.rmtree(place, ignore_errors=True)  # damaged; it is replaced
        else:
            return identity
    try:
        store.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=_TEMPORARY, dir=store))
        try:
            for name, content in files.items():
                _write(temporary / name, content)
            _rename(temporary, place)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        raise PolicyError(
            f"{store}: the policy could not be written: {error}", hint=f"set {STORE_VARIABLE} to a folder of your own"
        ) from error
    return identity


def load(policy_id: str, *, folder: Path | None = None) -> StoredPolicy:
    """Return a policy by its id, or by a unique beginning of it.

    Raises:
        PolicyError: The policy does not exist, is damaged, or does not fit this version of bimvox.
    """
    store = folder or store_folder()
    place = _place_of(policy_id, store)
    manifest = _read_manifest(place)
    weights = _read(place / WEIGHTS_FILE)
    if hashlib.sha256(weights).hexdigest() != manifest.weights_sha256:
        raise PolicyError(
            f"{place / WEIGHTS_FILE}: checksum mismatch: these are not the weights that the manifest names",
            differs={"weights_sha256": (hashlib.sha256(weights).hexdigest(), manifest.weights_sha256)},
            hint=f"remove it with `bimvox policy remove {place.name}` and train again",
        )
    require_fit(manifest)
    try:
        arrays = arrays_from_bytes(weights)
    except (SafetensorError, ValueError, KeyError) as error:
        raise PolicyError(f"{place / WEIGHTS_FILE}: not a safetensors file: {error}") from error
    network = network_from_arrays(arrays)
    if network.layer_sizes != manifest.layer_sizes:
        raise PolicyError(
            f"{place}: the weights have layers {network.layer_sizes}, the manifest says {manifest.layer_sizes}",
            differs={"layer_sizes": (network.layer_sizes, manifest.layer_sizes)},
        )
    return StoredPolicy(manifest, network)


def find(geometry_key: str, *, folder: Path | None = None) -> tuple[PolicyManifest, ...]:
    """Return the policies trained for a geometry that fit this version, best first; empty if there are none."""
    fitting = [
        manifest
        for manifest in scan(folder=folder).manifests
        if manifest.geometry_key == geometry_key and manifest.fits
    ]
    return tuple(sorted(fitting, key=lambda m: (-m.success_rate, m.length_ratio, m.id)))


def nearest(site: SiteOutline, *, folder: Path | None = None) -> tuple[tuple[float, PolicyManifest], ...]:
    """Return the fitting policies of other sites with their distances, nearest first.

    A policy of a similar site is used only on request.

    Args:
        site: Outline of the site that needs a policy.
        folder: The store; default: the user's own.
    """
    near = [
        (distance(site, manifest.site), manifest)
        for manifest in scan(folder=folder).manifests
        if manifest.site is not None and manifest.fits
    ]
    return tuple(sorted(near, key=lambda pair: (pair[0], -pair[1].success_rate, pair[1].length_ratio, pair[1].id)))


def scan(*, folder: Path | None = None) -> StoreScan:
    """Return every manifest of the store; weights are checked only when a policy is loaded."""
    store = folder or store_folder()
    manifests, damaged = [], []
    places = sorted(store.iterdir()) if store.is_dir() else []
    for place in places:
        if not place.is_dir() or place.name.startswith(_TEMPORARY):
            continue
        try:
            manifests.append(_read_manifest(place))
        except PolicyError as error:
            damaged.append((place.name, error.message))
    return StoreScan(tuple(manifests), tuple(damaged))


def remove(policy_id: str, *, folder: Path | None = None) -> str:
    """Remove a policy, damaged or not, and return its full id.

    Raises:
        PolicyError: The policy does not exist, or cannot be removed.
    """
    place = _place_of(policy_id, folder or store_folder())
    try:
        shutil.rmtree(place)
    except OSError as error:
        raise PolicyError(f"{place}: the policy could not be removed: {error}") from error
    return place.name


def _place_of(policy_id: str, store: Path) -> Path:
    """Return the folder of the only policy whose id begins with a text."""
    wanted = policy_id.lower()
    names = sorted(p.name for p in store.iterdir() if p.is_dir()) if store.is_dir() else []
    names = [name for name in names if not name.startswith(_TEMPORARY)]
    matching = [name for name in names if wanted and name.startswith(wanted)]
    if len(matching) != 1:
        what = f"{len(matching)} policies begin with {policy_id!r}" if matching else f"there is no policy {policy_id!r}"
        raise PolicyError(
            f"{store}: {what}",
            differs={"available": matching or names},
            hint="`bimvox policy list` shows what there is",
        )
    return store / matching[0]


def _read_manifest(place: Path) -> PolicyManifest:
    """Read a manifest and check it against its id and its folder's name."""
    file = place / MANIFEST_FILE
    try:
        plain = json.loads(_read(file).decode())
    except (ValueError, RecursionError) as error:
        raise PolicyError(f"{file}: not JSON: {error}") from error
    try:
        manifest = manifest_from_dict(plain)
        identity = id_of(plain)
    except (PolicyError, ValueError) as error:
        differs = error.differs if isinstance(error, PolicyError) else None
        raise PolicyError(f"{file}: {error}", differs=differs) from error
    if not manifest.id == identity == place.name:
        raise PolicyError(
            f"{file}: changed since it was written: its id is {manifest.id}, its content's {identity}, "
            f"its folder's {place.name}",
            differs={"id": (manifest.id, identity, place.name)},
            hint="remove the policy and train again",
        )
    return manifest


def _read(file: Path) -> bytes:
    """Return a file's bytes.

    Raises PolicyError: it cannot be read, or is too large for a policy.
    """
    return read_input(file, _unreadable, most_bytes=LARGEST_FILE_BYTES, may_be_empty=True)


def _unreadable(file: Path, message: str, *, hint: str | None = None) -> PolicyError:
    return PolicyError(f"{file}: {message}", hint=hint)


def _write(file: Path, content: bytes) -> None:
    """Write a file and flush it to the disk, before the rename that follows."""
    with file.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def _rename(temporary: Path, place: Path) -> None:
    """Rename a complete folder; another process may have created the same one meanwhile."""
    try:
        temporary.rename(place)
    except OSError:
        if not place.is_dir():
            raise


class Checkpoint:
    """The best policy of a running training, kept next to the policy store until the training ends.

    Its name is a hash of the arguments, so another training does not find it.

    Args:
        geometry_key: Digest of the site.
        config: The choices.
        seed: The seed.
        parent: Id of the initial policy. None if the training starts from scratch.
        budget: Environment steps.
    """

    def __init__(self, geometry_key: str, config: DqnConfig, seed: int, parent: str | None, budget: int) -> None:
        identity = json.dumps([geometry_key, config.to_dict(), seed, parent, budget], sort_keys=True)
        folder = store_folder()
        name = hashlib.sha256(identity.encode()).hexdigest()[:16]
        self._geometry_key = geometry_key
        self.folder = folder.with_name(f"{folder.name}-unfinished") / name

    def save(self, policy: TrainedPolicy) -> None:
        """Replace the checkpoint, completely or not at all."""
        parent = self.folder.parent
        try:
            parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".writing-", dir=parent) as temporary:
                save(policy, self._geometry_key, folder=Path(temporary) / "new")
                old = Path(temporary) / "old"
                if self.folder.exists():
                    self.folder.rename(old)
                (Path(temporary) / "new").rename(self.folder)
        except OSError as error:
            raise FileError(self.folder, f"the checkpoint could not be written: {error}") from error

    def load(self) -> TrainedPolicy | None:
        """Return the checkpoint. None if there is none that this version can use."""
        names = sorted(place.name for place in self.folder.iterdir()) if self.folder.is_dir() else []
        if len(names) != 1:
            return None
        try:
            return load(names[0], folder=self.folder).trained
        except PolicyError:
            return None

    def remove(self) -> None:
        """Remove the checkpoint, at the end of the training."""
        shutil.rmtree(self.folder, ignore_errors=True)
