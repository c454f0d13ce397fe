"""The studio as a web application: the page's files, and an interface in JSON for its own page alone.

Every request names this machine as its host. Those to the interface carry the token of the printed address in a header,
which a page of another origin cannot send, and come from no other origin.
"""

from __future__ import annotations

import gc
import hmac
import json
import logging
import os
import threading
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from bimvox.errors import BimvoxError, InputError
from bimvox.files import kept_to, reason_of, require_input, sha256_of
from bimvox.progress import SilentProgress
from bimvox.rendering.page.page import POLICY, START, media_type, web_files
from bimvox_pipeline.render.revisions import page_of_log
from bimvox_pipeline.studio.jobs import Folder, Jobs
from bimvox_pipeline.studio.obstacles import boxes_of, file_of, write_boxes
from bimvox_pipeline.studio.opened import SITE_SUFFIX, ChangedMeanwhileError, Opened, open_model, open_site, unchanged
from bimvox_pipeline.studio.saving import save
from bimvox_pipeline.studio.setup import read_setup
from bimvox_pipeline.studio.standing import PlanOnDisk, plan_on_disk, sha256_or_none

_MOST_BYTES = 8 << 20
_KEPT = 6
_PICTURE_PX = (960, 640)
_MOST_DEG = 3600.0
_LOG = logging.getLogger("uvicorn.error")
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
}


_Key = TypeVar("_Key")
_Value = TypeVar("_Value")
_State = tuple[Path, int, int]
"""A file, and what changes when it is written."""


def _state_of(file: Path) -> _State:
    status = file.stat()
    return file, status.st_mtime_ns, status.st_size


class _Kept(OrderedDict[_Key, _Value]):
    """The values that were set last."""

    def __setitem__(self, key: _Key, value: _Value) -> None:
        super().__setitem__(key, value)
        self.move_to_end(key)
        while len(self) > _KEPT:
            self.popitem(last=False)


class Studio:
    """What a studio knows between requests.

    Args:
        folder: The folder whose files it shows.
        token: What every request must carry.
    """

    def __init__(self, folder: Path, token: str) -> None:
        self.folder, self.token = Folder(folder), token
        self.jobs = Jobs(self.folder)
        self._lock, self._reading = threading.Lock(), threading.Lock()
        self._plans: _Kept[tuple[_State, ...], PlanOnDisk | None] = _Kept()
        self._hashes: dict[_State, str] = {}
        self._opened: _Kept[Path, Opened] = _Kept()
        self._pages: _Kept[tuple[_State, ...], bytes] = _Kept()

    def opened(self, relative: object, *, anew: bool = False) -> Opened:
        """Return the site of a site file, or of a model without one."""
        path = self.folder.path(relative)
        if not path.name.lower().endswith(SITE_SUFFIX):
            beside = path.with_name(path.stem + SITE_SUFFIX)
            path = self.folder.inside(beside) if os.path.lexists(beside) else path
        found = self._opened.get(path) or self._opened.get(path.with_name(path.stem + SITE_SUFFIX))
        if found is None or (anew and not (unchanged(found) and self._has_its_model(found))):
            is_site = path.name.lower().endswith(SITE_SUFFIX)
            found = open_site(path) if is_site else open_model(path)
        self._keep(found)
        return found

    def _has_its_model(self, opened: Opened) -> bool:
        """Return whether the model on disk is the one that was read; its hash is kept until the file changes."""
        model = opened.given.model.path
        model = model if model.is_absolute() else opened.site.parent / model
        if not model.exists():
            return False
        key = _state_of(model)
        if key not in self._hashes:
            self._hashes = {key: sha256_of(model)}
        # The hash of a glTF is also of its other files.
        return model.suffix.lower() == ".gltf" or self._hashes[key] == opened.building.source.sha256

    def _keep(self, opened: Opened) -> None:
        with self._lock:
            self._opened[opened.site] = opened

    def open(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Open a site."""
        found = self.opened(asked.get("path"), anew=True)
        document = found.document(self.folder.relative(found.site))
        # What is open stays: without this, every collection looks at all of it, in the middle of a drag.
        gc.unfreeze()
        gc.collect()
        gc.freeze()
        return document

    def tried(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Try a set-up."""
        return self.opened(asked.get("path")).tried(read_setup(asked.get("setup")))

    def picture(self, asked: dict[str, Any]) -> Response:
        """Draw a set-up in 3-D; a header says where its ground is."""
        turn_deg = asked.get("turn_deg", 0)
        if not _is_number(turn_deg) or not abs(turn_deg) <= _MOST_DEG:
            raise InputError("turn_deg is an angle in degrees")
        opened, wanted = self.opened(asked.get("path")), read_setup(asked.get("setup"))
        png, ground = opened.picture(wanted, float(turn_deg), _PICTURE_PX)
        where = json.dumps({"size": _PICTURE_PX, "corners": ground})
        return Response(png, media_type="image/png", headers={"X-Bimvox-Ground": where})

    def save(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Save a set-up."""
        opened = self.opened(asked.get("path"), anew=True)
        if asked.get("sha256") != opened.sha256:
            raise ChangedMeanwhileError(opened.site)
        return self._saved(*save(opened, read_setup(asked.get("setup"))))

    def variant(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Save a set-up as a new site file beside the one that is open."""
        opened, name = self.opened(asked.get("path")), asked.get("name")
        name = name.strip() if isinstance(name, str) else ""
        if not name or Path(name).name != name or name[0] == "." or not name.isprintable():
            raise InputError("a variant needs a name of its own", hint="letters, digits, spaces, dots and dashes")
        target = opened.site.with_name(name.removesuffix(SITE_SUFFIX) + SITE_SUFFIX)
        return self._saved(*save(opened, read_setup(asked.get("setup")), target))

    def _saved(self, opened: Opened, changed: list[str]) -> dict[str, Any]:
        self._keep(opened)
        return {"path": self.folder.relative(opened.site), "sha256": opened.sha256, "changed": changed}

    def plan(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Start a plan."""
        return {"job": self.jobs.plan(self._saved_site(asked))}

    def job(self, number: str) -> dict[str, Any]:
        """Return how far a plan is, and how it ended."""
        job = self.jobs.job(number)
        found: dict[str, Any] = {**job.now, "document": None}
        if job.is_running:
            return {"state": "running", **found}
        if "document" in job.end:
            return {"state": "done", **found, **self.folder.told(job.end), "page": self._page_of(job.log)}
        if job.is_cancelled:
            return {"state": "cancelled", **found}
        return {"state": "failed", **found, **self.folder.told(job.error)}

    def cancel(self, number: str) -> dict[str, Any]:
        """Cancel a plan."""
        self.jobs.job(number).stop(gently=False)
        return self.job(number)

    def watch(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Start a watch."""
        site, speed = self._saved_site(asked), asked.get("simulate")
        if speed is not None and not (_is_number(speed) and 0.001 <= speed <= 1e6):
            raise InputError("simulate is how many times as fast as real time, such as 60")
        return {"watch": self.jobs.watch(site, speed)}

    def news(self, number: str, after: int) -> dict[str, Any]:
        """Return what a watch reports from an event on; waits for some seconds if there is nothing."""
        job = self.jobs.job(number)
        events = job.events_after(after)
        state = "running" if job.has_events else "starting"
        if not job.is_running:
            state = "failed" if job.has_failed else "ended"
        error = job.error if state == "failed" else {}
        found = {"state": state, "stage": job.now["stage"], "events": events, "next": after + len(events)}
        return {**self.folder.told({**found, **error}), "page": self._page_of(job.log)}

    def end_watch(self, number: str) -> dict[str, Any]:
        """End a watch."""
        self.jobs.job(number).stop(gently=True)
        return self.news(number, 0)

    def boxes(self, relative: object) -> dict[str, Any]:
        """Return the boxes of a site's obstruction file."""
        site = self.folder.path(relative, SITE_SUFFIX)
        return {"file": self.folder.relative(file_of(site)), **boxes_of(site)}

    def set_boxes(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Write the boxes of a site's obstruction file."""
        site = self._saved_site(asked)
        written = write_boxes(site, asked.get("obstructions"), asked.get("sha256"))
        return {"file": self.folder.relative(file_of(site)), **written}

    def standing(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Return the plan on disk of a site, and what differs from what the page shows.

        Without a set-up, it is compared with the site file as it is saved.
        """
        site = self.folder.path(asked.get("path"), SITE_SUFFIX)
        obstructions = self.folder.inside(file_of(site))
        there = {"sha256": sha256_or_none(site), "obstructions_sha256": sha256_or_none(obstructions), "plan": None}
        log = self.folder.log_of(site)
        if there["sha256"] is None or (found := self._plan_on_disk(log)) is None:
            return there
        by_page = "setup" in asked
        opened = self.opened(asked.get("path"), anew=not by_page)
        wanted = read_setup(asked["setup"]) if by_page else opened.setup
        differs = found.differences(opened, wanted, obstructions)
        if by_page and not asked.get("sha256") == opened.sha256 == there["sha256"]:
            differs = ["the site file on disk", *differs]
        if not self._has_its_model(opened):
            differs = ["the model on disk", *differs]
        plan = {**found.document, "page": self._page_of(log), "is_current": not differs, "differs": differs}
        return {**there, "plan": plan}

    def _plan_on_disk(self, log: Path) -> PlanOnDisk | None:
        """Return the newest plan of a log, read again if one of its files has changed."""
        files = [file for file in self.folder.with_revisions(log) if file.exists()]
        if not files:
            return None
        key = tuple(map(_state_of, files))
        with self._reading:
            if key not in self._plans:
                self._plans[key] = plan_on_disk(log)
            return self._plans[key]

    def _saved_site(self, asked: dict[str, Any]) -> Path:
        site = self.folder.path(asked.get("path"), SITE_SUFFIX)
        if not site.exists():
            raise InputError(f"{site.name} is not saved yet", hint="save it first")
        return require_input(site)

    def _page_of(self, log: Path) -> str:
        return f"/page/{self.folder.relative(log)}"

    def page(self, relative: str) -> bytes:
        """Return the page of a log and its later revisions, proven now."""
        log = self.folder.path(relative, ".mcap")
        if not log.exists():
            raise InputError(f"there is no {relative}", hint="plan the site first")
        files = self.folder.with_revisions(log)
        key = tuple(map(_state_of, files))
        if key not in self._pages:
            made = page_of_log(log, proven=True, progress=SilentProgress())
            with self._lock:
                self._pages[key] = made
            return made
        return self._pages[key]


def application(studio: Studio, port: int) -> ASGIApp:
    """Return the application of a studio that listens on a port of this machine."""
    files = web_files()
    api, by_path = partial(_api, studio.folder), partial(_by_path, studio.folder)

    def start(_: Request) -> Response:
        return Response(files[START], media_type=media_type(START), headers={"Content-Security-Policy": POLICY})

    def web(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in files:
            return _refusal(404, "there is no such file")
        return Response(files[name], media_type=media_type(name))

    async def page(request: Request) -> Response:
        made: Response | bytes = await _answered(studio.folder, partial(studio.page, request.path_params["log"]))
        if isinstance(made, Response):
            return made
        headers = {"Content-Security-Policy": "frame-ancestors 'self'"}
        return Response(made, media_type="text/html; charset=utf-8", headers=headers)

    routes = [
        Route("/", start),
        Route("/web/{name:path}", web),
        Route("/page/{log:path}", page),
        Route("/api/files", api(lambda _: {"folder": studio.folder.root.name, "files": studio.folder.files()})),
        Route("/api/open", api(studio.open), methods=["POST"]),
        Route("/api/try", api(studio.tried), methods=["POST"]),
        Route("/api/picture", api(studio.picture), methods=["POST"]),
        Route("/api/save", api(studio.save), methods=["POST"]),
        Route("/api/variant", api(studio.variant), methods=["POST"]),
        Route("/api/standing", api(studio.standing), methods=["POST"]),
        Route("/api/plan", api(studio.plan), methods=["POST"]),
        Route("/api/plan/{job}", by_path(lambda ask: studio.job(ask.path_params["job"]))),
        Route("/api/plan/{job}", by_path(lambda ask: studio.cancel(ask.path_params["job"])), methods=["DELETE"]),
        Route("/api/obstructions", by_path(lambda ask: studio.boxes(ask.query_params.get("path")))),
        Route("/api/obstructions", api(studio.set_boxes), methods=["POST"]),
        Route("/api/watch", api(studio.watch), methods=["POST"]),
        Route("/api/watch/{job}", by_path(lambda ask: studio.news(ask.path_params["job"], _number(ask)))),
        Route("/api/watch/{job}", by_path(lambda ask: studio.end_watch(ask.path_params["job"])), methods=["DELETE"]),
    ]
    return _Guard(Starlette(routes=routes), studio.token, port)


def _api(folder: Folder, answer: Callable[[dict[str, Any]], dict[str, Any] | Response]) -> Callable[[Request], Any]:
    """Return the endpoint of a function from a JSON object to a JSON object, or to another answer."""

    async def endpoint(request: Request) -> Response:
        asked: Any = {}
        if request.method == "POST":
            body = b""
            async for chunk in request.stream():
                body += chunk
                if len(body) > _MOST_BYTES:
                    return _refusal(413, "the request is too large")
            try:
                asked = json.loads(body)
                json.dumps(asked, ensure_ascii=False).encode()  # half a pair of surrogates is no character
            except (ValueError, RecursionError):
                asked = None
            if not isinstance(asked, dict):
                return _refusal(400, "the request is not a JSON object")
        made = await _answered(folder, partial(answer, asked))
        if isinstance(made, Response) and made.status_code == HTTPStatus.CONFLICT:
            # What was refused goes back to who entered it.
            edit = {key: asked[key] for key in ("setup", "obstructions") if key in asked}
            return JSONResponse({**json.loads(bytes(made.body)), **edit}, HTTPStatus.CONFLICT)
        return made if isinstance(made, Response) else JSONResponse(made)

    return endpoint


def _by_path(folder: Folder, answer: Callable[[Request], dict[str, Any]]) -> Callable[[Request], Any]:
    """Return the endpoint of a function of an address."""

    async def endpoint(request: Request) -> Response:
        made = await _answered(folder, partial(answer, request))
        return made if isinstance(made, Response) else JSONResponse(made)

    return endpoint


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number(request: Request) -> int:
    """Return the number of the first event that is asked for."""
    given = request.query_params.get("after", "0")
    if not (given.isascii() and given.isdigit() and len(given) < 10):
        raise InputError("after is the number of an event, from 0")
    return int(given)


async def _answered(folder: Folder, answer: Callable[[], Any]) -> Any:
    """Return an answer, made in a thread; an error as a response, with paths as the page has them."""

    def made() -> Any:
        with kept_to(folder.root):
            return answer()

    try:
        return await run_in_threadpool(made)
    except ChangedMeanwhileError as error:
        return _error(HTTPStatus.CONFLICT, folder, error)
    except BimvoxError as error:
        return _error(400, folder, error)
    except OSError as error:
        return _refusal(400, folder.told(f"{error.filename or 'a file'}: {reason_of(error)}"))
    except MemoryError:
        return _refusal(500, "this needs more memory than there is")
    except Exception as error:  # noqa: BLE001  # the last handler: the page says it, and the studio goes on
        said = f"sorry, bimvox failed: {type(error).__name__}: {error}".splitlines()[0]
        return JSONResponse({"error": folder.told(said), "where": None, "hint": "this is a fault of bimvox"}, 500)


def _error(status: int, folder: Folder, error: BimvoxError) -> JSONResponse:
    where = getattr(error, "key", None)
    return JSONResponse(folder.told({"error": error.message, "where": where, "hint": error.hint}), status)


def _refusal(status: int, said: str) -> JSONResponse:
    return JSONResponse({"error": said, "where": None, "hint": None}, status)


class _Guard:
    """Refuses every request that does not come from the studio's own page."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app, self._token = app, token.encode()
        self._hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        refused = self._refused(request)
        if refused is not None:
            await refused(scope, receive, _with_headers(send))
            return
        try:
            await self._app(scope, receive, _with_headers(send))
        except ClientDisconnect:
            _LOG.warning("A page closed its connection in the middle of %s %s", request.method, request.url.path)

    def _refused(self, request: Request) -> Response | None:
        if request.headers.get("host") not in self._hosts:
            return _refusal(403, "the studio answers only to this machine")
        if not {f"http://{host}" for host in self._hosts}.issuperset(request.headers.getlist("origin")):
            return _refusal(403, "the studio answers only to its own page")
        path = request.url.path
        if path.startswith("/web/"):
            return None  # nothing but our own code, whose modules cannot carry a token
        given = request.headers.get("x-bimvox-token") if path.startswith("/api/") else request.query_params.get("token")
        if given is None or not hmac.compare_digest(given.encode(), self._token):
            return _refusal(403, "the token is missing or wrong: open the address that bimvox studio printed")
        return None


def _with_headers(send: Send) -> Send:
    async def sending(message: Any) -> None:
        if message["type"] == "http.response.start":
            own = [(name.lower().encode(), value.encode()) for name, value in _HEADERS.items()]
            message = {**message, "headers": [*message.get("headers", []), *own]}
        await send(message)

    return sending
