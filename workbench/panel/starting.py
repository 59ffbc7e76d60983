"""Start a run from the page: dry run, confirmation, and the very command of the terminal.

A dry run and a run are `workbench run` in a process of its own, with the checks, journal, lock and
guardian that it has at a terminal. A confirmation is valid once, for what the dry run showed: the
command is given the digest of its files and refuses others. Nothing starts by loading a page.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any

from workbench.errors import ControllerGone
from workbench.output import MAY_BE_ON
from workbench.panel.protocols import Protocols
from workbench.run import START, VARIABLE, SessionFile, holder, press_stop, session_files

__all__ = ["Starter"]

_MAIN = "from workbench.cli import main; main()"
COMMAND = (sys.executable, "-P", "-c", _MAIN, "run", "--quiet")
"""A file of the working folder must not be imported in place of a module."""
DRY_RUN_S = 120.0
"""Longest time of a dry run [s]."""
CLOSE_S = 20.0
"""How long a panel that is closed waits for the run that it stops [s]."""
ENDS_S = 5.0
"""Longest time that a process takes to end after its session [s]."""
MOST_CONFIRMATIONS = 16
"""Dry runs that wait to be confirmed; the oldest makes way."""
MOST_TEXT = 6000
"""Characters of an error that the page shows."""
LONGEST_NAME = 80
_FLAGS = 0  # with a new session: out of reach of the panel's terminal
if sys.platform == "win32":
    _FLAGS = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP


@dataclass(frozen=True)
class _Confirmation:
    """What a dry run showed.

    Args:
        path: of the protocol.
        title: of the protocol.
        plan_id: digest of all files that the plan was made from.
    """

    path: Path
    title: str
    plan_id: str


@dataclass
class _Started:
    """A run that was started here.

    Args:
        identity: by which its session file is recognised.
        title: of its protocol.
        operator: who started it.
        process: of the command.
        output: what it prints for people.
        seen: whether the page has shown its session; then its end is shown there too.
        stopped: whether it was ended before it had one.
    """

    identity: str
    title: str
    operator: str
    process: subprocess.Popen[bytes]
    output: IO[bytes]
    seen: bool = False
    stopped: bool = False

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    @cached_property
    def text(self) -> str:
        """Return what the command printed, once it has ended: both write and read at one place."""
        with self.output as file:
            file.seek(0)
            return _readable(file.read())


class Starter:
    """Starts runs of the protocols of one folder, one at a time.

    Args:
        protocols: that may be started.
        runs: folder of all bundles.
        command: that carries a protocol out; its arguments follow.
    """

    def __init__(self, protocols: Protocols, runs: Path, command: Sequence[str] = COMMAND) -> None:
        self.protocols = protocols
        self._runs, self._command = runs, command
        self._starting, self._rehearsing = threading.Lock(), threading.Lock()
        self._confirmations: dict[str, _Confirmation] = {}
        self._started: _Started | None = None

    def dry_run(self, name: str) -> dict[str, Any]:
        """Return the dry run of a protocol, and the token that confirms it once."""
        path = self.protocols.path_of(name)
        if path is None:
            return _no(f"No protocol {name!r} in {self.protocols.folder}.")
        if busy := self._busy():
            return _no(busy)
        if not self._rehearsing.acquire(blocking=False):  # or STOP could be without a connection
            return _no("Another dry run is being made; try again when it is done.")
        try:
            done = subprocess.run(
                [*self._command, "--dry-run", "--json", *self._arguments(path)],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                env=_environment({}),
                timeout=DRY_RUN_S,
                check=False,
                start_new_session=True,
                creationflags=_FLAGS,
            )
        except subprocess.TimeoutExpired:
            return _no(
                f"The dry run took longer than {DRY_RUN_S:g} s and was ended. In a terminal: "
                f"workbench run {path} --dry-run"
            )
        except OSError as error:
            return _no(f"The dry run was not made: {error}")
        finally:
            self._rehearsing.release()
        said = _readable(done.stderr)
        if done.returncode != 0:
            return _no(said or f"The dry run ended with exit code {done.returncode}.")
        plan = json.loads(done.stdout)
        token = secrets.token_urlsafe(24)
        confirmation = _Confirmation(path, plan["title"], plan["plan_id"])
        with self._starting:
            kept = list(self._confirmations.items())[1 - MOST_CONFIRMATIONS :]
            self._confirmations = dict([*kept, (token, confirmation)])
        for run in plan["runs"]:
            del run["instants"]  # what is written to the supply, long
        return {"plan": plan, "token": token, "text": said}

    def start(self, token: str, operator: str) -> dict[str, Any]:
        """Start what a dry run showed, once; the reply says whether, and why not."""
        name = " ".join(operator.split())
        if not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
            return _not_started(
                f"Type the operator's name, 1 to {LONGEST_NAME} characters; it is written into the "
                "run."
            )
        with self._starting:
            if token not in self._confirmations:
                return _not_started(
                    "This dry run was confirmed already, or was made before the panel was started "
                    "again; nothing was started. Look at the dry run again."
                )
            if busy := self._busy():
                return _not_started(busy)
            confirmation = self._confirmations.pop(token)
            self._forget()
            try:
                self._started = self._launched(confirmation, name)
            except OSError as error:
                return _not_started(f"The run could not be started: {error}")
        return {"started": True, "text": ""}

    def facts_of(self, fact: Mapping[str, Any]) -> dict[str, str] | None:
        """Return what the page shows of a start that has no session yet, or never had one.

        Args:
            fact: what the session file of the run that is shown says.
        """
        mine = self._started
        if mine is None:
            return None
        mine.seen = mine.seen or fact.get("start") == mine.identity
        if mine.seen:
            return None
        who = f"“{mine.title}”, started by {mine.operator}"
        if mine.alive:
            return {"level": "plain", "title": "Starting", "text": f"{who}."}
        code = mine.process.returncode
        if code == 0:
            return None
        if mine.stopped:
            text = f"{who}, was stopped before it began; nothing was driven."
            return {"level": "plain", "title": "Stopped", "text": text}
        said = mine.text or f"exit code {code}"
        level = "alarm" if MAY_BE_ON in said else "bad"
        return {"level": level, "title": "Not started", "text": f"{who}:\n{said}"}

    def stop_before_session(self) -> str | None:
        """End a run that has no session yet, where STOP would reach nobody; return its title."""
        mine = self._started
        if mine is None or not mine.alive or mine.seen or self._session(mine) is not None:
            return None
        mine.stopped = True
        mine.process.terminate()  # as Ctrl-C; on Windows at once, where it holds nothing yet
        return mine.title

    @property
    def alive(self) -> bool:
        """Whether a run that was started here goes on."""
        return self._started is not None and self._started.alive

    def close(self) -> None:
        """Stop the run that was started here, as Ctrl-C in its terminal would; wait for its end."""
        mine = self._started
        if mine is None:
            return
        pressed, until = False, time.monotonic() + CLOSE_S
        while mine.alive and time.monotonic() < until:
            session = self._session(mine)
            if session is None:
                self.stop_before_session()
            elif not pressed:
                with suppress(ControllerGone):
                    press_stop(session)
                    pressed = True
            time.sleep(0.05)
        self._forget()

    def _forget(self) -> None:
        """Let go of the last run, whose session has ended."""
        if self._started is not None:
            with suppress(subprocess.TimeoutExpired):
                self._started.process.wait(ENDS_S)
            self._started.output.close()

    def _arguments(self, path: Path) -> list[str]:
        return ["--bench", self.protocols.bench, "--runs", str(self._runs), "--", str(path)]

    def _launched(self, start: _Confirmation, operator: str) -> _Started:
        identity = secrets.token_hex(8)
        # a pipe would break with the panel, and the run with it
        output = tempfile.TemporaryFile()  # noqa: SIM115  it is read when the run has ended
        process = subprocess.Popen(
            [*self._command, "--plan-id", start.plan_id, *self._arguments(start.path)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=output,
            env=_environment({VARIABLE: operator, START: identity}),
            start_new_session=True,
            creationflags=_FLAGS,
        )
        return _Started(identity, start.title, operator, process, output)

    def _session(self, mine: _Started) -> SessionFile | None:
        return next(
            (c for c in session_files(self._runs) if c.facts.get("start") == mine.identity), None
        )

    def _busy(self) -> str | None:
        """Say who carries out what in this folder of runs; None when nobody does."""
        for session in session_files(self._runs):
            if holder(self._runs, session.experiment) is not None:
                fact = session.facts
                return (
                    f"“{fact.get('title', session.experiment)}” is under way on bench "
                    f"{fact.get('bench')}, process {session.pid}, started by "
                    f"{fact.get('operator')}; wait for its end, or press STOP."
                )
        mine = self._started
        if mine is not None and mine.alive and not mine.seen:
            return f"“{mine.title}” is being started by {mine.operator}."
        return None


def _environment(more: Mapping[str, str]) -> dict[str, str]:
    environment = {name: value for name, value in os.environ.items() if name != START}
    return {**environment, "PYTHONIOENCODING": "utf-8", **more}


def _readable(data: bytes) -> str:
    text = re.sub(r"^workbench: ", "", data.decode("utf-8", "replace").strip(), flags=re.MULTILINE)
    return text if len(text) <= MOST_TEXT else f"...{text[-MOST_TEXT:]}"


def _no(text: str) -> dict[str, Any]:
    return {"plan": None, "token": None, "text": text}


def _not_started(text: str) -> dict[str, Any]:
    return {"started": False, "text": text}
