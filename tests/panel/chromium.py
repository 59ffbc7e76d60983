"""A real browser without a window, driven over its DevTools protocol."""

from __future__ import annotations

import base64
import itertools
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
ANSWER_S = 15.0
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
    "--remote-debugging-port=0", "--disable-background-networking", "--disable-dev-shm-usage",
)  # fmt: skip


class NavigatedError(AssertionError):
    """A page went to another address while something was asked of it."""


class Browser:
    """The whole browser; a page is a tab of it.

    Args:
        link: to its DevTools.
    """

    def __init__(self, link: ClientConnection) -> None:
        self._link = link
        self._numbers = itertools.count(1)
        self._told: list[dict[str, Any]] = []

    def open(self, url: str, width: int = 1280, height: int = 1000, script: str = "") -> Page:
        """Open a tab and wait until it has loaded; a script runs before the page's own."""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, target, session)
        for domain in ("Page", "Runtime", "Network", "Log"):
            page.ask(f"{domain}.enable")
        page.resize(width, height)
        page.ask("Page.addScriptToEvaluateOnNewDocument", source=script)
        page.ask("Page.navigate", url=url)
        page.wait_for("document.readyState === 'complete' && location.href !== 'about:blank'")
        return page

    def ask(self, method: str, session: str | None = None, **params: Any) -> Any:
        """Send one command and return its result."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": params}
        self._link.send(json.dumps(message | ({"sessionId": session} if session else {})))
        deadline = time.monotonic() + ANSWER_S
        while True:
            found = json.loads(self._link.recv(timeout=deadline - time.monotonic()))
            if found.get("id") == number:
                if "navigated" in found.get("error", {}).get("message", ""):
                    raise NavigatedError(f"{method}: {found['error']}")
                assert "error" not in found, f"{method}: {found['error']}"
                return found["result"]
            self._told.append(found)

    def told(self, session: str, *methods: str) -> list[dict[str, Any]]:
        """Return what a tab has told so far, the parameters of each event."""
        mine = [one for one in self._told if one.get("sessionId") == session]
        return [one["params"] for one in mine if one["method"] in methods]


class Page:
    """One tab."""

    def __init__(self, browser: Browser, target: str, session: str) -> None:
        self._browser, self._target, self._session = browser, target, session

    def ask(self, method: str, **params: Any) -> Any:
        return self._browser.ask(method, self._session, **params)

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in the page, awaited."""
        found = self.ask(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait_for(self, expression: str, seconds: float = 20.0) -> float:
        """Wait until an expression is true and return how long that took [s]."""
        began = time.monotonic()
        while not self._holds(expression):
            took = time.monotonic() - began
            assert took < seconds, f"not within {seconds} s: {expression}\n{self.text('body')}"
            time.sleep(0.02)
        return time.monotonic() - began

    def _holds(self, expression: str) -> bool:
        """Return whether an expression is true; a page that is on its way elsewhere has none."""
        try:
            return bool(self.evaluate(expression))
        except NavigatedError:
            return False

    def text(self, selector: str) -> str:
        """Return what a person reads there."""
        return self.evaluate(f"document.querySelector({json.dumps(selector)}).innerText")

    def sees(self, selector: str) -> bool:
        """Whether it is shown at all."""
        return self.evaluate(
            f"document.querySelector({json.dumps(selector)}).offsetParent !== null"
        )

    def click(self, selector: str) -> float:
        """Press and release the mouse on the middle of it, and return when it was pressed."""
        x, y = self.evaluate(
            f"(() => {{ const r = document.querySelector({json.dumps(selector)})"
            ".getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        button = {"x": x, "y": y, "button": "left", "clickCount": 1}
        pressed = time.monotonic()
        self.ask("Input.dispatchMouseEvent", type="mousePressed", **button)
        self.ask("Input.dispatchMouseEvent", type="mouseReleased", **button)
        return pressed

    def key(self, name: str, code: int, text: str = "") -> None:
        """Press and release a key."""
        key = {"key": name, "code": name, "windowsVirtualKeyCode": code}
        self.ask("Input.dispatchKeyEvent", type="keyDown", text=text, **key)
        self.ask("Input.dispatchKeyEvent", type="keyUp", **key)

    def type(self, text: str) -> None:
        """Type into what has the focus."""
        self.ask("Input.insertText", text=text)

    def resize(self, width: int, height: int) -> None:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **metrics)

    def scheme(self, name: str) -> None:
        """Prefer `light` or `dark`."""
        features = [{"name": "prefers-color-scheme", "value": name}]
        self.ask("Emulation.setEmulatedMedia", features=features)

    def picture(self, path: Path) -> None:
        """Save what is in the window."""
        data = self.ask("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))

    def requests(self) -> list[str]:
        """Return every address that the page asked for."""
        self.evaluate("1")
        told = self._browser.told(self._session, "Network.requestWillBeSent")
        return [one["request"]["url"] for one in told]

    def complaints(self) -> list[str]:
        """Return what the browser's console holds against the page."""
        self.evaluate("1")
        entries = self._browser.told(self._session, "Log.entryAdded")
        thrown = self._browser.told(self._session, "Runtime.exceptionThrown")
        return [one["entry"]["text"] for one in entries] + [str(one) for one in thrown]

    def close(self) -> None:
        self._browser.ask("Target.closeTarget", targetId=self._target)


@contextmanager
def browser() -> Iterator[Browser]:
    """Start the browser; skip the test where there is none."""
    found = next((name for name in BROWSERS if shutil.which(name)), None)
    if found is None:
        words = f"needs a browser: {', '.join(BROWSERS)}"
        pytest.fail(words) if os.environ.get("WORKBENCH_BROWSER") else pytest.skip(words)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [found, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        log = Path(profile) / "log.txt"
        with log.open("w") as file:
            process = subprocess.Popen(
                command, stdout=file, stderr=file, start_new_session=True, env=dict(os.environ)
            )
        try:
            address = _wait_for(lambda: re.search(r"listening on (ws://\S+)", log.read_text()))
            # events pile up while no test asks: a full queue would keep pongs from being read
            with connect(
                address[1], max_size=None, max_queue=None, ping_interval=None, compression=None
            ) as link:
                yield Browser(link)
        finally:
            process.terminate()
            process.wait(10)


def _wait_for(look: Callable[[], re.Match[str] | None]) -> re.Match[str]:
    deadline = time.monotonic() + 60
    while (found := look()) is None:
        assert time.monotonic() < deadline, "the browser does not start"
        time.sleep(0.05)
    return found
