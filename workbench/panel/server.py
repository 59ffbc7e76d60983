"""The web server of the panel: the page, its events, STOP, pause, answers, start of runs."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import uvicorn
from fastapi import FastAPI, HTTPException
from fastapi import Query as QueryParameter
from fastapi.responses import FileResponse, Response, StreamingResponse
from pydantic import BaseModel, Field

from workbench.errors import ControllerGone, InputError
from workbench.loopback import HERE
from workbench.panel.guard import REPORT_POLICY, Guard
from workbench.panel.runs import compare_page, rows_json, trend_page
from workbench.panel.starting import Starter
from workbench.panel.view import FRONT_SWITCH, NOTHING_TO_STOP
from workbench.panel.watcher import TICK_S, Watcher
from workbench.run import SessionFile, answer, holder, pause, press_stop, session_files

__all__ = ["Panel"]

MOST_PAGES = 4
"""A browser opens six connections to a host: with more streams than this STOP had to wait."""
BEAT_S = 0.5
"""How often a page is sent the times, even when nothing is new [s]."""
BATCH = 2000
"""Most readings that are sent at once."""
PICTURES = (".png", ".jpg", ".jpeg", ".gif", ".webp", ".svg")
PAGE = {
    "": ("index.html", "text/html; charset=utf-8"),
    "panel.css": ("panel.css", "text/css; charset=utf-8"),
    "panel.js": ("panel.js", "text/javascript; charset=utf-8"),
    "start.js": ("start.js", "text/javascript; charset=utf-8"),
    "list": ("list.html", "text/html; charset=utf-8"),
    "list.js": ("list.js", "text/javascript; charset=utf-8"),
    "runs.css": ("runs.css", "text/css; charset=utf-8"),
    "icon.svg": ("icon.svg", "image/svg+xml"),
}


class AnswerRequest(BaseModel):
    """What a page sends to answer a prompt."""

    question: int
    text: Annotated[str, Field(max_length=2000)] = ""


class DryRunRequest(BaseModel):
    """What a page sends to have the dry run of a protocol made."""

    name: Annotated[str, Field(max_length=255)]


class StartRequest(BaseModel):
    """What a page sends to start what a dry run showed."""

    token: Annotated[str, Field(max_length=100)]
    operator: Annotated[str, Field(max_length=1000)]


class PauseRequest(BaseModel):
    """What a page sends to have it asked after the run what is done next, or not."""

    on: bool


class Panel:
    """The panel of one folder of runs, on 127.0.0.1 alone.

    Args:
        watcher: of the folder.
        starter: starts runs.
        port: to serve at; 0 takes a free one.

    Attributes:
        url: of the page, with its token.

    Raises:
        InputError: when the port is taken.
    """

    def __init__(self, watcher: Watcher, starter: Starter, port: int = 0) -> None:
        try:
            self._socket = socket.create_server((HERE, port))
        except OSError as error:
            raise InputError(
                f"port {port} cannot be used ({error.strerror}); try --port 0"
            ) from None
        token = secrets.token_urlsafe(24)
        self.port: int = self._socket.getsockname()[1]
        self.url = f"http://{HERE}:{self.port}/{token}/"
        config = uvicorn.Config(
            Guard(_app(_Pages(watcher, self._ends), starter), token, self.port),
            log_level="warning",
            access_log=False,  # it would hold the token
            server_header=False,
            http="h11",  # which bounds the head of a request
            ws="none",
            lifespan="off",
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)

    def serve(self) -> None:
        """Serve until Ctrl-C, which ends with `KeyboardInterrupt`, or `stop`."""
        self._server.run(sockets=[self._socket])

    def stop(self) -> None:
        """Let `serve` return; safe in any thread."""
        self._server.should_exit = True

    def _ends(self) -> bool:
        """Return whether nobody is let in any more: as long as STOP is served, pages are."""
        return not all(server.is_serving() for server in self._server.servers)


def _app(pages: _Pages, starter: Starter) -> FastAPI:
    """Return what the guard lets through: the stream, STOP, pause, answers, starts, and files."""
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    watcher = pages.watcher

    @app.get("/events")
    async def events() -> Response:
        return StreamingResponse(pages.stream(), media_type="text/event-stream")

    @app.post("/stop")
    async def stop() -> dict[str, Any]:
        return await _in_thread(lambda: _stop(watcher, starter))

    @app.post("/pause")
    async def pause_after(wanted: PauseRequest) -> dict[str, Any]:
        return await _in_thread(lambda: _pause(watcher, wanted))

    @app.post("/answer")
    async def give_answer(given: AnswerRequest) -> dict[str, Any]:
        return await _in_thread(lambda: _answer(watcher, given))

    @app.get("/protocols.json")
    def protocols() -> dict[str, Any]:
        return starter.protocols.rows()

    @app.post("/dry-run")
    async def dry_run(wanted: DryRunRequest) -> dict[str, Any]:
        return await _in_thread(lambda: starter.dry_run(wanted.name))

    @app.post("/start")
    async def start(confirmed: StartRequest) -> dict[str, Any]:
        return await _in_thread(lambda: starter.start(confirmed.token, confirmed.operator))

    _add_runs(app, watcher.runs)
    _add_files(app, watcher)  # last, as any name is looked up there
    return app


def _add_runs(app: FastAPI, root: Path) -> None:
    """Serve what is known of all runs; each in a thread of its own, as the disk may be slow."""

    @app.get("/list.json")
    def rows() -> Response:
        return Response(rows_json(root), media_type="application/json")

    @app.get("/compare")
    def compare(run: Annotated[list[str], QueryParameter()]) -> Response:
        return _page(lambda: compare_page(root, run))

    @app.get("/trend")
    def trend(like: str = "") -> Response:
        return _page(lambda: trend_page(root, like))


def _page(make: Callable[[], str]) -> Response:
    try:
        return Response(make(), media_type="text/html; charset=utf-8")
    except InputError as error:
        raise HTTPException(404, str(error)) from None


def _add_files(app: FastAPI, watcher: Watcher) -> None:
    """Serve the page itself, the reports, and the picture of the prompt that is shown."""

    @app.get("/picture/{number}")
    async def picture(number: int) -> Response:
        asked = watcher.controller.published.get("question") or {}
        path = Path(asked.get("picture") or "") if asked.get("number") == number else Path()
        if path.suffix.lower() not in PICTURES or not path.is_file():
            raise HTTPException(404, "no such picture")
        return FileResponse(path, headers={"content-security-policy": REPORT_POLICY})

    @app.get("/runs/{name}/report.html")
    async def report(name: str) -> Response:
        found = watcher.listing.view_of(name, "report")
        if found is None:
            raise HTTPException(404, "no such report")
        headers = {"content-security-policy": REPORT_POLICY}
        return FileResponse(found, media_type="text/html; charset=utf-8", headers=headers)

    @app.get("/runs/{name}/recording")
    async def recording(name: str) -> Response:
        found = watcher.listing.view_of(name, "recording")
        if found is None:
            raise HTTPException(404, "no such recording")
        return FileResponse(found, filename=f"{name}{found.suffix}")

    @app.get("/")
    @app.get("/{name}")
    async def page(name: str = "") -> Response:
        if name not in PAGE:
            raise HTTPException(404, "no such page")
        file, kind = PAGE[name]
        return Response(
            files("workbench.panel").joinpath("page", file).read_bytes(), media_type=kind
        )


async def _in_thread(work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Do something in a thread that nobody else waits for; a pool could be busy."""
    done: Future[dict[str, Any]] = Future()

    def run() -> None:
        try:
            done.set_result(work())
        except BaseException as error:
            done.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return await asyncio.wrap_future(done)


def _stop(watcher: Watcher, starter: Starter) -> dict[str, Any]:
    """Stop whatever runs in this folder, all at once, and return what was reached."""
    begun = starter.stop_before_session()
    found = session_files(watcher.runs)
    with ThreadPoolExecutor(max(len(found), 1)) as pool:  # one that hangs delays no other
        reached = list(pool.map(_press_stop, found))
    stopped = [session for session, ok in zip(found, reached, strict=True) if ok]
    missed = [session for session, ok in zip(found, reached, strict=True) if not ok]
    hanging = [
        session for session in missed if holder(watcher.runs, session.experiment) is not None
    ]
    if hanging:
        names = ", ".join(f"process {session.pid} ({_title(session)})" for session in hanging)
        text = f"{names} does not answer. Use {FRONT_SWITCH} now."
    elif stopped:
        text = f"Stopping: {', '.join(map(_title, stopped))}."
    elif begun is not None:
        text = f"Stopping: {begun}, which had not begun."
    else:
        text = NOTHING_TO_STOP
    return {"stopped": len(stopped), "hanging": len(hanging), "text": text}


def _press_stop(session: SessionFile) -> bool:
    try:
        press_stop(session)
    except ControllerGone:
        return False
    return True


def _title(session: SessionFile) -> str:
    return str(session.facts.get("title", session.experiment))


def _answer(watcher: Watcher, given: AnswerRequest) -> dict[str, Any]:
    """Bring an answer to the run that is shown."""
    session = watcher.controller.session
    if session is None:
        return {"taken": False, "text": "No run waits for an answer."}
    try:
        taken = answer(session, given.question, given.text)
    except ControllerGone as error:
        return {"taken": False, "text": f"The run cannot be reached: {error}."}
    return {"taken": taken, "text": "" if taken else "It had been answered already."}


def _pause(watcher: Watcher, wanted: PauseRequest) -> dict[str, Any]:
    """Bring the wish for a pause to the run that is shown."""
    session = watcher.controller.session
    if session is None:
        return {"pausing": False, "text": "No run is under way."}
    try:
        return {"pausing": pause(session, wanted.on), "text": ""}
    except ControllerGone as error:
        return {"pausing": False, "text": f"The run cannot be reached: {error}."}


class _Pages:
    """The streams of the pages that are open; the oldest ends when there are too many.

    Args:
        watcher: knows what they show.
        ends: returns whether the server ends, so that no stream holds it up.
    """

    def __init__(self, watcher: Watcher, ends: Callable[[], bool]) -> None:
        self.watcher = watcher
        self._ends = ends
        self._open: list[object] = []

    async def stream(self) -> AsyncIterator[str]:
        """Yield what is new, as server-sent events; a page that does not read is not waited for."""
        me = object()
        self._open = [*self._open, me][-MOST_PAGES:]
        self._count()
        try:
            async for event in self._news(me):
                yield event
            if me not in self._open:
                yield _event("replaced", {})
        finally:
            self._open = [one for one in self._open if one is not me]
            self._count()

    def _count(self) -> None:
        self.watcher.pages = len(self._open)

    async def _news(self, me: object) -> AsyncIterator[str]:
        sent: dict[str, Any] = {}
        plotted, count, beat = None, 0, 0.0
        while me in self._open and not self._ends():
            picture = self.watcher.picture
            for name, value in (("state", picture.state), ("runs", picture.runs)):
                if sent.get(name) != value:
                    sent[name] = value
                    beat = 0.0
                    yield _event(name, value)
            if picture.following is not plotted:
                plotted, count = picture.following, 0
                yield _event("readings", {"first": 0})
            while plotted is not None and count < len(plotted.readings):
                columns = plotted.readings.between(count, count + BATCH)
                yield _event("readings", {"first": count} | columns)
                count += len(columns["amps"])
            if time.monotonic() - beat > BEAT_S:
                beat = time.monotonic()
                age = round(beat - picture.made, 2)  # old when nothing looks any more
                yield _event("clocks", picture.clocks | {"age_s": age})
            await asyncio.sleep(TICK_S)


def _event(name: str, value: dict[str, Any]) -> str:
    return f"event: {name}\ndata: {json.dumps(value, ensure_ascii=False, default=str)}\n\n"
