"""What another process does at the desk of a run: watch, answer, stop; each on its own line."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

from workbench.desk.card import Card
from workbench.errors import ControllerGone
from workbench.loopback import HERE, Line, Message

__all__ = ["answer", "pause", "press_stop", "watch"]

_REACHED_S = 0.5  # a process that lives accepts at once


def press_stop(card: Card) -> None:
    """Do what Ctrl-C in the terminal of a run does; returns when it was done.

    Raises:
        ControllerGone: when its process is dead or hangs.
    """
    _ask(card, {"want": "stop"})


def answer(card: Card, question: int, text: str) -> bool:
    """Answer a question; False when it was answered already.

    Raises:
        ControllerGone: when its process is dead or hangs.
    """
    return bool(_ask(card, {"want": "answer", "question": question, "text": text}).get("taken"))


def pause(card: Card, on: bool) -> bool:
    """Have it asked after the run what is done next, or not; returns whether it will be.

    Raises:
        ControllerGone: when its process is dead or hangs.
    """
    return bool(_ask(card, {"want": "pause", "on": on}).get("pausing"))


@contextmanager
def watch(card: Card) -> Iterator[Line]:
    """Watch a run: what the desk shows comes over the line, something every `BEAT_S`.

    Raises:
        ControllerGone: when its process is dead.
    """
    line = _visit(card, {"want": "watch"})
    try:
        yield line
    finally:
        line.close()


def _ask(card: Card, what: Message) -> Message:
    line = _visit(card, what)
    try:
        found = line.receive(_REACHED_S)
    except OSError as error:
        raise ControllerGone(f"process {card.pid} is gone ({error})") from None
    finally:
        line.close()
    if found is None:
        raise ControllerGone(f"process {card.pid} hangs: no answer within {_REACHED_S:g} s")
    return found


def _visit(card: Card, what: Message) -> Line:
    port, token = int(card.facts.get("port", 0)), card.facts.get("token", "")
    try:
        line = Line(socket.create_connection((HERE, port), _REACHED_S))
        line.send({"token": token} | what)
    except OSError as error:
        raise ControllerGone(f"process {card.pid} is gone ({error})") from None
    return line
