"""The studio as a web application: the page's files, and an interface in JSON for its own page alone.

Every request names this machine as its host. Those to the interface carry the token of the printed address in a header,
which a page of another origin cannot send, and come from no other origin.
"""

from __future__ import annotations

import hmac
import json
import logging
import tempfile
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from bimvox.errors import BimvoxError, InputError
from bimvox.files import MOST_BYTES, kept_to, reason_of
from bimvox.rendering.page.page import POLICY, START, media_type, web_files
from bimvox_pipeline.studio.documents import REPORTS
from bimvox_pipeline.studio.folder import Folder
from bimvox_pipeline.studio.opened import ChangedMeanwhileError
from bimvox_pipeline.studio.studio import Studio
from bimvox_pipeline.studio.uploading import ThereAlreadyError

__all__ = ["Studio", "application"]

_MOST_BYTES = 8 << 20
_REPORT_POLICY = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:"
"""A report is a file of the folder: it may be anybody's, so it runs nothing here."""
_LOG = logging.getLogger("uvicorn.error")
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
}


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
        made: Response | bytes = await _answered(studio.folder, partial(studio.plans.page, request.path_params["log"]))
        if isinstance(made, Response):
            return made
        headers = {"Content-Security-Policy": "frame-ancestors 'self'"}
        return Response(made, media_type="text/html; charset=utf-8", headers=headers)

    async def document(request: Request) -> Response:
        found = partial(studio.document_file, request.path_params["name"])
        file: Response | Path = await _answered(studio.folder, found)
        if isinstance(file, Response):
            return file
        if file.name.endswith(REPORTS):
            policy = {} if file.suffix == ".pdf" else {"Content-Security-Policy": _REPORT_POLICY}
            return FileResponse(file, headers=policy)
        return FileResponse(file, filename=file.name, media_type="application/octet-stream")

    async def upload(request: Request) -> Response:
        asked = request.query_params
        with tempfile.TemporaryFile(dir=studio.folder.root) as spool:
            size = 0
            async for chunk in request.stream():
                size += len(chunk)
                if size > MOST_BYTES:
                    return _refusal(413, f"the file is larger than {MOST_BYTES >> 20:,} MiB, the most that is read")
                await run_in_threadpool(spool.write, chunk)
            spool.seek(0)
            put = partial(studio.upload, asked.get("path"), spool, asked.get("over"))
            made = await _answered(studio.folder, put)
        return made if isinstance(made, Response) else JSONResponse(made)

    routes = [
        Route("/", start),
        Route("/web/{name:path}", web),
        Route("/page/{log:path}", page),
        Route("/document/{name:path}", document),
        Route("/api/files", api(lambda _: {"folder": studio.folder.root.name, "files": studio.folder.files()})),
        Route("/api/open", api(studio.open), methods=["POST"]),
        Route("/api/try", api(studio.tried), methods=["POST"]),
        Route("/api/picture", api(studio.picture), methods=["POST"]),
        Route("/api/save", api(studio.save), methods=["POST"]),
        Route("/api/variant", api(studio.variant), methods=["POST"]),
        Route("/api/state", api(studio.plans.state), methods=["POST"]),
        Route("/api/found", api(studio.plans.found), methods=["POST"]),
        Route("/api/document", api(studio.document), methods=["POST"]),
        Route("/api/upload", upload, methods=["POST"]),
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
    except ThereAlreadyError as error:
        return _error(HTTPStatus.CONFLICT, folder, error, sha256=error.sha256)
    except BimvoxError as error:
        return _error(400, folder, error)
    except OSError as error:
        return _refusal(400, folder.told(f"{error.filename or 'a file'}: {reason_of(error)}"))
    except MemoryError:
        return _refusal(500, "this needs more memory than there is")
    except Exception as error:  # noqa: BLE001  # the last handler: the page says it, and the studio goes on
        said = f"sorry, bimvox failed: {type(error).__name__}: {error}".splitlines()[0]
        return JSONResponse({"error": folder.told(said), "where": None, "hint": "this is a fault of bimvox"}, 500)


def _error(status: int, folder: Folder, error: BimvoxError, **more: str) -> JSONResponse:
    where = getattr(error, "key", None)
    return JSONResponse(folder.told({"error": error.message, "where": where, "hint": error.hint, **more}), status)


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
