"""Who may see the page: whoever knows the token in its address, on this computer, and nobody else.

The page of another site can send requests to 127.0.0.1 too, and a name of its own can be made to
point there. So each request has to name this computer as its host, has to begin with the token, and
one that changes something has to come from this page itself.
"""

from __future__ import annotations

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
HEADERS = {
    "content-security-policy": PAGE_POLICY,
    "cache-control": "no-store",
    "referrer-policy": "no-referrer",  # the address holds the token
    "x-content-type-options": "nosniff",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}


class Guard:
    """Refuses whoever does not know the token, and tells browsers to be strict.

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
            await PlainTextResponse(f"refused: {reason}\n", 403, HEADERS)(scope, receive, send)
            return
        inner = dict(scope) | {"path": scope["path"][len(self._token) + 1 :]}
        await self._app(inner, receive, _strict(send))

    def _refused(self, scope: Scope) -> str | None:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        if host not in self._hosts:
            return "this page is for this computer alone; use the address that was printed"
        given = scope["path"].split("/")[1]
        if not hmac.compare_digest(given.encode(), self._token.encode()):
            return "the address lacks its token; use the address that `workbench panel` printed"
        if scope["method"] not in SAFE and origin != f"http://{host}":
            return "only the panel's own page may do that"
        return None


def _strict(send: Send) -> Send:
    async def strict(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return strict
