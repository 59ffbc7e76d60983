"""What a guardian shouts: nobody has to listen."""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from workbench.hw import NO_RECORDS, SystemClock
from workbench.hw.guardian import records as under_test


@pytest.mark.skipif(sys.platform == "win32", reason="its pipes are not filled in this way")
def test_a_terminal_that_takes_nothing_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(under_test, "LAST_WORDS_S", 0.2)
    out, into = os.pipe()
    os.set_blocking(into, False)
    with suppress(BlockingIOError):
        while True:
            os.write(into, bytes(4096))
    os.set_blocking(into, True)
    with os.fdopen(into, "w", encoding="utf-8") as stopped, os.fdopen(out, "rb") as terminal:
        monkeypatch.setattr(sys, "stderr", stopped)
        recorder = under_test.EventRecorder(NO_RECORDS, SystemClock())
        began = time.monotonic()
        for _ in range(100):
            recorder.shout("OUTPUT MAY BE ON")
        recorder.close_terminal()
        assert time.monotonic() - began < 1.0
        heard = b""
        while heard.count(b"guardian: OUTPUT MAY BE ON\n") < 100:  # it goes on where it stopped
            heard += terminal.read1(65536)


def test_what_was_said_is_written_before_the_end(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with (tmp_path / "said").open("w", encoding="utf-8") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        recorder = under_test.EventRecorder(NO_RECORDS, SystemClock())
        recorder.shout("one")
        recorder.shout("two")
        recorder.close_terminal()
    assert (tmp_path / "said").read_text(encoding="utf-8") == "guardian: one\nguardian: two\n"
