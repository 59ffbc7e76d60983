"""What another process asks of a run: watch, answer, stop; each over a connection of its own."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

from workbench.errors import ControllerGone
from workbench.loopback import HERE, Message, MessageLine
from workbench.run.control.session import SessionFile

__all__ = ["answer", "pause", "press_stop", "watch"]

_REACHED_S = 0.5  # a process that lives accepts at once


def press_stop(session: SessionFile) -> None:
    """Do what Ctrl-C in the terminal of a run does; returns when it was done.

    Raises:
        ControllerGone: when its process is dead or hangs.
    """
    _ask(session, {"want": "stop"})


def answer(session: SessionFile, question: int, text: str) -> bool:
    """Answer a question; False when it was answered already.

    Raises:
        ControllerGone: when its process is dead or hangs.
    """
    return bool(_ask(session, {"want": "answer", "question": question, "text": text}).get("taken"))


def pause(session: SessionFile, on: bool) -> bool:
    """Have it asked after the run what is done next, or not; returns whether it will be.

    Raises:
        ControllerGone: when its process is dead or hangs.
    """
    return bool(_ask(session, {"want": "pause", "on": on}).get("pausing"))


@contextmanager
def watch(session: SessionFile) -> Iterator[MessageLine]:
    """Watch a run: what it publishes comes over the line, something every `BEAT_S`.

    Raises:
        ControllerGone: when its process is dead.
    """
    line = _connect(session, {"want": "watch"})
    try:
        yield line
    finally:
        line.close()


def _ask(session: SessionFile, what: Message) -> Message:
    line = _connect(session, what)
    try:
        found = line.receive(_REACHED_S)
    except OSError as error:
        raise ControllerGone(f"process {session.pid} is gone ({error})") from None
    finally:
        line.close()
    if found is None:
        raise ControllerGone(f"process {session.pid} hangs: no answer within {_REACHED_S:g} s")
    return found


def _connect(session: SessionFile, what: Message) -> MessageLine:
    port, token = int(session.facts.get("port", 0)), session.facts.get("token", "")
    try:
        line = MessageLine(socket.create_connection((HERE, port), _REACHED_S))
        line.send({"token": token} | what)
    except OSError as error:
        raise ControllerGone(f"process {session.pid} is gone ({error})") from None
    return line
