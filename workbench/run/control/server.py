"""The control server: on loopback, in the process of a run.

    client                                          server
    {"token": "...", "want": "stop"}                {"stopped": 1}
    {"token": "...", "want": "answer",
     "question": 3, "text": "12 cm"}                {"taken": true}
    {"token": "...", "want": "pause", "on": true}   {"pausing": true}
    {"token": "...", "want": "watch"}
    {"pages": 1}                                    {"phase": "rest 2 s", "question": {...}, ...}
    ...                                             ...

Each client has a thread of its own, so one that hangs holds up nobody: the run only ever leaves
what it has to say, under a lock that no thread holds while it sends.
"""

from __future__ import annotations

import hmac
import itertools
import queue
import secrets
import signal
import socket
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from workbench.loopback import HERE, Message, MessageLine
from workbench.run.control.session import claim

if TYPE_CHECKING:
    from workbench.run.takes import AnsweredAt  # which loads all of tracking

__all__ = [
    "BEAT_S",
    "FOUND_S",
    "ControlServer",
    "PendingPrompt",
    "PublishedState",
    "Reply",
    "open_control_server",
]

BEAT_S = 0.25
"""How often a client that watches is sent something, even when nothing is new [s]."""
FOUND_S = 1.5
"""A panel that is open finds a server that opens within this time [s]."""
_HELLO_S = 1.0
_FAREWELL_S = 0.5  # for those who watch to learn how it ended


class Reply(NamedTuple):
    """What was answered, and where."""

    text: str
    answered_at: AnsweredAt


class PendingPrompt:
    """A prompt that waits for its first reply.

    Args:
        number: of this question.
        text: of the prompt.
        default: taken when nothing is typed.
    """

    def __init__(self, number: int, text: str, default: str) -> None:
        self.number, self.text, self.default = number, text, default
        self._replies: queue.SimpleQueue[Reply] = queue.SimpleQueue()
        self._open = threading.Lock()  # who acquires it, answers

    def offer(self, reply: Reply) -> bool:
        """Answer it; False when somebody was first. Safe in any thread."""
        first = self._open.acquire(blocking=False)
        if first:
            self._replies.put(reply)
        return first

    def wait(self, timeout: float) -> Reply | None:
        """Return the first reply, or None when there is none within `timeout` [s]."""
        with suppress(queue.Empty):
            return self._replies.get(timeout=timeout)
        return None


@dataclass(frozen=True)
class PublishedState:
    """What everybody who watches sees.

    Args:
        phase: what the run does now.
        since: when that began, by `time.monotonic()`.
        notice: the last text for the operator, of this phase or question.
        question: that waits for an answer: `number`, `text`, `typed`, `default`, `picture`,
            `choices`.
        stops: how often STOP was pressed.
        pausing: whether somebody wants to be asked after this run.
        live: how the live twin goes, in JSON's terms; None without one.
        ended: how it ended, `kind` and `text`; None while it goes on.
    """

    phase: str = ""
    since: float = field(default_factory=time.monotonic)
    notice: str = ""
    question: Mapping[str, Any] | None = None
    stops: int = 0
    pausing: bool = False
    live: Mapping[str, Any] | None = None
    ended: Mapping[str, str] | None = None

    def message(self) -> Message:
        """Return it for the line; times are ages there [s]."""
        facts = asdict(self)
        return facts | {"since": round(time.monotonic() - facts["since"], 3)}


class ControlServer:
    """Where a run leaves what it does, and others answer and stop it.

    Attributes:
        token: whoever knows it may do what the one at the terminal may.
        port: on loopback.
        outcome: kind of the end where nothing was raised.
    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(24)
        self.outcome = "complete"
        self._listener = socket.create_server((HERE, 0))
        self.port: int = self._listener.getsockname()[1]
        self._news = threading.Condition()
        self._state, self._version = PublishedState(), 0
        self._question: PendingPrompt | None = None
        self._numbers = itertools.count(1)
        self._opened = time.monotonic()
        self._pages: dict[int, int] = {}  # of each client that watches
        threading.Thread(target=self._receive_clients, name="control", daemon=True).start()

    @property
    def attended(self) -> bool:
        """Whether somebody looks at the run from elsewhere, and could answer there.

        A server that has just been opened gives a page that waits for it the time to find it.
        """
        with self._news:
            remaining_s = self._opened + FOUND_S - time.monotonic()
            return self._news.wait_for(lambda: any(self._pages.values()), max(remaining_s, 0.0))

    @property
    def pausing(self) -> bool:
        """Whether somebody wants to be asked after this run."""
        return self._state.pausing

    def want_pause(self, on: bool) -> None:
        """Ask after this run what is done next, or do not; safe in any thread."""
        self._show(pausing=on)

    def show_phase(self, text: str) -> None:
        """Show what the run does from now on."""
        self._show(phase=text, since=time.monotonic(), notice="")

    def show_notice(self, text: str) -> None:
        """Show a text for the operator."""
        self._show(notice=text)

    def show_live(self, facts: Mapping[str, Any] | None) -> None:
        """Show how the live twin goes; safe in any thread."""
        self._show(live=facts)

    @contextmanager
    def ask(
        self,
        text: str,
        *,
        typed: bool,
        default: str = "",
        picture: Path | None = None,
        choices: Sequence[str] = (),
    ) -> Iterator[PendingPrompt]:
        """Let a prompt be answered until the block ends.

        Args:
            text: of the prompt.
            typed: whether something is to be typed, not only confirmed.
            default: taken when nothing is typed.
            picture: shown with it.
            choices: the only answers that will be taken; none where any may be.
        """
        question = PendingPrompt(next(self._numbers), text, default)
        published = {"number": question.number, "text": text, "typed": typed, "default": default}
        published |= {"picture": None if picture is None else str(picture.resolve())}
        published |= {"choices": list(choices)}
        self._question = question
        self._show(question=published)
        try:
            yield question
        finally:
            self._question = None
            self._show(question=None, notice="")

    def close(self, kind: str, text: str) -> None:
        """Say how it ended to whoever watches, for a moment, and let nobody in any more."""
        self._show(ended={"kind": kind, "text": text}, question=None)
        deadline = time.monotonic() + _FAREWELL_S
        while self._pages and time.monotonic() < deadline:
            time.sleep(0.01)
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)  # wakes the thread that accepts
        self._listener.close()

    def _show(self, **changed: Any) -> None:
        with self._news:
            self._state, self._version = replace(self._state, **changed), self._version + 1
            self._news.notify_all()

    def _receive_clients(self) -> None:
        for number in itertools.count():
            try:
                link, _ = self._listener.accept()
            except OSError:  # closed
                return
            arguments = (link, number)
            threading.Thread(target=self._receive, args=arguments, daemon=True).start()

    def _receive(self, link: socket.socket, number: int) -> None:
        line = MessageLine(link)
        with suppress(OSError):
            hello = line.receive(_HELLO_S) or {}
            if hmac.compare_digest(str(hello.get("token", "")).encode(), self.token.encode()):
                self._serve(line, hello, number)
        line.close()

    def _serve(self, line: MessageLine, hello: Message, number: int) -> None:
        match hello.get("want"):
            case "stop":
                press_ctrl_c()  # before anything that could take time
                line.send({"stopped": 1})
                self._show(stops=self._state.stops + 1)
            case "pause":
                self.want_pause(hello.get("on") is True)
                line.send({"pausing": self.pausing})
            case "answer":
                line.send({"taken": self._answer(hello.get("question"), hello.get("text"))})
            case "watch":
                try:
                    self._let_watch(line, number)
                finally:
                    self._note_pages(number, None)

    def _answer(self, number: object, text: object) -> bool:
        question = self._question
        if question is None or question.number != number or not isinstance(text, str):
            return False
        return question.offer(Reply(text.strip() or question.default, "panel"))

    def _let_watch(self, line: MessageLine, number: int) -> None:
        self._note_pages(number, 0)
        seen, state = -1, self._state
        while state.ended is None:
            seen, state = self._news_after(seen)
            line.send(state.message())
            while (message := line.receive(0.0)) is not None:
                self._note_pages(number, int(message.get("pages", 0)))

    def _news_after(self, seen: int) -> tuple[int, PublishedState]:
        """Wait for something new, or a beat, and return it with its number."""
        with self._news:
            self._news.wait_for(lambda: self._version != seen, BEAT_S)
            return self._version, self._state

    def _note_pages(self, number: int, pages: int | None) -> None:
        """Note how many pages a client shows, None when it has left."""
        with self._news:
            self._pages.pop(number, None)
            self._pages |= {} if pages is None else {number: pages}
            self._news.notify_all()


def press_ctrl_c() -> None:
    """Do to this program what Ctrl-C in its terminal does; safe in any thread."""
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:  # wakes a wait of the main thread
        signal.pthread_kill(main, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


@contextmanager
def open_control_server(
    runs: Path, experiment: str, facts: Mapping[str, Any]
) -> Iterator[ControlServer]:
    """Serve an experiment, with its session file, until the block ends.

    Args:
        runs: folder of all bundles.
        experiment: name of the experiment.
        facts: for the session file, besides `port` and `token`.

    Raises:
        InputError: when another process carries it out.
    """
    server, kind, text = ControlServer(), "", ""
    address = {"port": server.port, "token": server.token}
    try:
        with claim(runs, experiment, {**facts, **address}), _sigint_enabled():
            yield server
        kind = text = server.outcome
    except BaseException as error:
        kind, text = type(error).__name__, str(error)
        raise
    finally:
        server.close(kind, text)


@contextmanager
def _sigint_enabled() -> Iterator[None]:
    """Let SIGINT end the program even where its parent had it ignored, as a shell does with `&`."""
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    if not ignored or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
