"""Who may see the page: whoever knows the token in its address, on this computer, and nobody else.

The page of another site can send requests to 127.0.0.1 too, and a name of its own can be made to
point there. So each request has to name this computer as its host, has to begin with the token, and
one that changes something has to come from this page itself. What a request brings along is bounded
before it is read: in bytes by what it announces, and in time.
"""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse

__all__ = ["REPORT_POLICY", "Guard"]

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
REPORT_POLICY = "sandbox allow-popups; default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""A report was made of files that others wrote: it may be looked at, and do nothing."""
SAFE = ("GET", "HEAD")
MOST_BODY = 65_536
"""Most bytes of a request beside its head: the longest answer, written as clumsily as can be."""
BODY_S = 5.0
"""Longest time in which they have to come [s]; our own page sends them at once."""
HEADERS = {
    "content-security-policy": PAGE_POLICY,
    "cache-control": "no-store",
    "referrer-policy": "no-referrer",  # the address holds the token
    "x-content-type-options": "nosniff",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}


class Guard:
    """Refuses whoever does not know the token, and sets strict headers for browsers.

    Args:
        app: serves the rest.
        token: first part of each path.
        port: where it is served.
    """

    def __init__(self, app: App, token: str, port: int) -> None:
        self._app, self._token = app, token
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        reason = self._refused(scope)
        if reason is not None:
            await _refuse(403, reason, scope, send)
            return
        length, unfit = _length(Headers(scope=scope))
        if unfit is not None:
            await _refuse(*unfit, scope, send)
            return
        if length > 0:
            try:
                body = await asyncio.wait_for(_read(receive, length), BODY_S)
            except TimeoutError:
                await _refuse(408, f"the body did not come within {BODY_S:g} s", scope, send)
                return
            if body is None:  # whoever sent it is gone
                return
            receive = _after(body, receive)
        inner = dict(scope) | {"path": scope["path"][len(self._token) + 1 :]}
        await self._app(inner, receive, _strict(send))

    def _refused(self, scope: Scope) -> str | None:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        if host not in self._hosts:
            return "this page is for this computer alone; use the address that was printed"
        given = scope["path"].split("/")[1]
        if not hmac.compare_digest(given.encode(), self._token.encode()):
            return "the address has no token; use the address that `workbench panel` printed"
        if scope["method"] not in SAFE and origin != f"http://{host}":
            return "only the panel's own page may do that"
        return None


async def _refuse(code: int, reason: str, scope: Scope, send: Send) -> None:
    """Answer with a refusal, and close the connection: what still comes is not read."""
    headers = HEADERS | {"connection": "close"}
    await PlainTextResponse(f"refused: {reason}\n", code, headers)(scope, _nothing, send)


async def _nothing() -> MutableMapping[str, Any]:
    return {"type": "http.disconnect"}


def _length(headers: Headers) -> tuple[int, tuple[int, str] | None]:
    """Return how many bytes a request announces, and with which code and words it is refused."""
    if "transfer-encoding" in headers:
        return 0, (411, "a body has to announce its length")
    lengths = headers.getlist("content-length")
    if not lengths:
        return 0, None
    if len(lengths) > 1 or not (lengths[0].isascii() and lengths[0].isdecimal()):
        return 0, (400, "the length of the body is no number")
    digits = lengths[0].lstrip("0") or "0"
    if len(digits) > 9 or int(digits) > MOST_BODY:
        return 0, (413, f"{lengths[0][:20]} bytes; a body may have at most {MOST_BODY}")
    return int(digits), None


async def _read(receive: Receive, length: int) -> bytes | None:
    """Return the body of a request, None when its sender is gone before it is whole."""
    body = b""
    more = True
    while more and len(body) <= length:
        message = await receive()
        if message["type"] != "http.request":
            return None
        body += message.get("body", b"")
        more = message.get("more_body", False)
    return body


def _after(body: bytes, receive: Receive) -> Receive:
    """Return what gives a body that was read, and then whatever comes."""
    waiting = [body]

    async def give() -> MutableMapping[str, Any]:
        if waiting:
            return {"type": "http.request", "body": waiting.pop(), "more_body": False}
        return await receive()

    return give


def _strict(send: Send) -> Send:
    async def strict(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return strict
