"""The client's hold on its guardian: start it, ask it, notice soon when it is gone."""

from __future__ import annotations

import hmac
import itertools
import os
import secrets
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import workbench
from workbench.errors import HardwareError
from workbench.hw.guardian.lease import ACKNOWLEDGE_S, RENEW_S
from workbench.hw.guardian.messages import Task, error_of
from workbench.loopback import HERE, Message, MessageLine

__all__ = ["GuardianLost", "GuardianProcess", "GuardianTripped"]

START_S = 20.0  # a slow disk, a cold Python
CALL_S = 60.0  # the longest call: a ramp from 60 V
END_S = 8.0  # it may wait for a motor to coast
HELLO_S = 1.0


class GuardianLost(Exception):
    """The guardian is dead or hangs; whether the output is off is not known."""


class GuardianTripped(Exception):
    """The guardian switches off by itself; its reason is the text."""


class GuardianProcess:
    """A guardian that was started for one task.

    Args:
        task: what it is to do.

    Attributes:
        off: whether it read back off since it tripped.
        dead: whether the terminals were dead then; None while it is still trying.
        died: whether it ended without having reported that.

    Raises:
        HardwareError: when it does not start.
    """

    def __init__(self, task: Task) -> None:
        self._numbers = itertools.count(1)
        self._unanswered: float | None = None  # since when a renewal is
        self._timeout_s = ACKNOWLEDGE_S
        self._tripped = False
        self.off = False
        self.dead: bool | None = None
        self.died = False
        token = secrets.token_hex(16)
        with socket.create_server((HERE, 0)) as listener:
            self._process = _start()
            try:
                self._brief(f"{listener.getsockname()[1]} {token} {task.to_json()}\n")
                self._line = _accept(listener, token, self._process)
            except BaseException:
                self._process.kill()
                self._process.wait()
                raise

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def ask(self, call: str, *arguments: str | bool, timeout_s: float = ACKNOWLEDGE_S) -> Any:
        """Let it carry out one call and return the value; renews meanwhile.

        Args:
            call: name of a method of the supply.
            arguments: of the call.
            timeout_s: for how long it may acknowledge nothing [s].

        Raises:
            WorkbenchError: as the call itself does.
            GuardianLost: when it died or hangs.
            GuardianTripped: when it switched off.
        """
        number, self._timeout_s = next(self._numbers), timeout_s
        self._send({"id": number, "call": call, "arguments": arguments})
        deadline = time.monotonic() + CALL_S
        while time.monotonic() < deadline:
            answer = self._receive(RENEW_S)
            if answer is None:
                self._ask_for_life()
            elif answer.get("id") == number:  # another one belongs to a call that Ctrl-C cut
                if "error" in answer:
                    raise error_of(answer)
                return answer["value"]
        raise GuardianLost(f"did not answer {call!r} within {CALL_S:g} s")

    def renew(self, seconds: float) -> None:
        """Show progress, and listen for so long [s] whether it is alive. Raises as `ask`."""
        self._timeout_s = ACKNOWLEDGE_S
        self._ask_for_life()
        until = time.monotonic() + seconds
        while self._receive(max(until - time.monotonic(), 0.0)) or time.monotonic() < until:
            pass

    def verdict(self, seconds: float, *, dead: bool = False) -> bool:
        """Wait for what a guardian that tripped says of the output.

        Args:
            seconds: longest wait [s].
            dead: wait until the terminals were looked at, too.
        """
        until = time.monotonic() + seconds
        try:
            while self.dead is None and not (self.off and not dead):
                if (remaining_s := until - time.monotonic()) <= 0:
                    break
                self._note(self._line.receive(remaining_s) or {})
        except OSError:  # it has ended
            self.died = self.dead is None
            self.dead = self.dead or False
        return bool(self.dead) if dead else self.off

    def await_trip(self, seconds: float) -> None:
        """Wait until it says that it switches off. Raises as `ask`, always."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._receive(until - time.monotonic())
        raise GuardianLost(f"did not take over within {seconds:g} s")

    def _note(self, message: Message) -> None:
        self.off = message.get("off", self.off)
        self.dead = message.get("dead", self.dead)

    @property
    def trying(self) -> bool:
        """Whether it is there and has not yet said how it ended."""
        return self.dead is None and self._process.poll() is None

    def end(self, *, owned: bool = False) -> None:
        """Say goodbye and wait until it has ended; one that is still trying is left to it.

        Ending twice does no harm.

        Args:
            owned: the output may be on, so one that does not end in time is trying to switch off.
        """
        try:
            while message := self._line.receive(0.0):
                self._tripped = self._tripped or "tripped" in message
                self._note(message)
            self._line.send({"goodbye": 1})
            self._process.wait(END_S if self.dead is None and not self._tripped else 0.1)
        except (OSError, subprocess.TimeoutExpired):
            pass  # a Ctrl-C leaves it: it may still be trying to switch off
        if self._process.poll() is None and (self._tripped or owned) and not self.dead:
            threading.Thread(target=self._process.wait, name="reaper", daemon=True).start()
            self._line.close()
        else:
            self.kill()

    def kill(self) -> None:
        """End it at once, so that the port becomes free."""
        self._process.kill()
        self._process.wait()
        self._line.close()

    def _brief(self, text: str) -> None:
        if self._process.stdin is not None:
            with suppress(BrokenPipeError), self._process.stdin as pipe:  # its exit code says more
                pipe.write(text)

    def _ask_for_life(self) -> None:
        self._send({"renew": 1})
        if self._unanswered is None:
            self._unanswered = time.monotonic()

    def _send(self, message: Message) -> None:
        try:
            self._line.send(message)
        except OSError:
            self._receive(0.0)  # it may have said why
            raise GuardianLost("ended") from None

    def _receive(self, timeout: float) -> Message | None:
        since = time.monotonic() if self._unanswered is None else self._unanswered
        until = since + self._timeout_s  # an answer that is due is not waited for any longer
        try:
            message = self._line.receive(min(timeout, max(until - time.monotonic(), 0.0)))
        except OSError:
            raise GuardianLost("ended") from None
        if message is None:
            if self._unanswered is not None and time.monotonic() >= until:
                raise GuardianLost(f"hangs: it acknowledged nothing for {self._timeout_s:g} s")
            return None
        if "alive" in message:
            self._unanswered = None
        if "tripped" in message:
            self._tripped = True
            raise GuardianTripped(message["tripped"])
        return message


def _start() -> subprocess.Popen[str]:
    """Start the process out of reach of this terminal: Ctrl-C and Ctrl-Z stop a whole group."""
    # a file of the working folder must not be imported in place of a module
    command = [sys.executable, "-P", "-m", "workbench.hw.guardian"]
    source = str(Path(workbench.__file__).resolve().parents[1])
    path = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH", ""), source]))
    flags = 0
    if sys.platform == "win32":
        flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        encoding="utf-8",
        env=os.environ | {"PYTHONPATH": path},
        start_new_session=True,
        creationflags=flags,
    )


def _accept(listener: socket.socket, token: str, process: subprocess.Popen[str]) -> MessageLine:
    """Wait for the one who knows the token."""
    deadline = time.monotonic() + START_S
    listener.settimeout(RENEW_S)
    while time.monotonic() < deadline:
        if process.poll() is not None:
            raise HardwareError(f"the guardian did not start, exit code {process.returncode}")
        try:
            link, _ = listener.accept()
        except TimeoutError:
            continue
        link.settimeout(None)
        line = MessageLine(link)
        try:
            hello = line.receive(HELLO_S) or {}
        except OSError:
            hello = {}
        if hmac.compare_digest(str(hello.get("token", "")).encode(), token.encode()):
            return line
        line.close()
    raise HardwareError(f"the guardian did not start within {START_S:g} s")
