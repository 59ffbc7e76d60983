"""A supply's ledger: who may drive it next, whatever became of those before."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from workbench.errors import InputError
from workbench.output import Ledger, ledgers


@pytest.fixture
def ledger() -> Ledger:
    return Ledger(Ledger.key_of("RD6006", "00012345", "/dev/ttyUSB0"))


def seen_off(ledger: Ledger) -> None:
    ledger.write("off", confirmed=True)
    ledger.write("terminals", dead=True)


def test_it_is_named_after_model_and_serial_number_or_after_the_place(ledger: Ledger) -> None:
    assert ledger.key == "RD6006_00012345"
    assert Ledger.key_of("RD6006", "00012345", "COM4") == ledger.key
    assert Ledger.key_of("KA3005P", None, "/dev/ttyUSB0") == "KA3005P_dev_ttyUSB0"
    assert ledgers() == []
    ledger.write("taken", place="COM4")
    assert [one.key for one in ledgers()] == [ledger.key]
    assert ledger.address == "COM4"


def test_a_run_that_ends_as_it_should_leaves_nothing(ledger: Ledger) -> None:
    assert ledger.latch() is None
    ledger.write("taken")
    seen_off(ledger)
    ledger.write("output_on")
    seen_off(ledger)
    assert ledger.latch() is None


@pytest.mark.parametrize("ends", [("taken",), ("taken", "output_on")])
def test_a_record_that_ends_with_a_doubt_stands_until_it_is_signed_for(
    ledger: Ledger, ends: tuple[str, ...]
) -> None:
    for event in ends:
        ledger.write(event)
    standing = ledger.latch()
    assert standing is not None
    assert "its program and its guardian ended before off was confirmed" in standing.reason
    assert "OUTPUT MAY BE ON" in standing.description
    ledger.write("taken")  # the next one sees it off
    seen_off(ledger)
    standing = ledger.latch()
    assert standing is not None
    assert standing.description.endswith("the output is off, confirmed")
    with pytest.raises(InputError, match="needs the name of a person: --name NAME"):
        ledger.acknowledge(" ")
    ledger.acknowledge("Ada")
    assert ledger.latch() is None
    with pytest.raises(InputError, match="no stop is waiting for an acknowledgement"):
        ledger.acknowledge("Ada")


def test_while_a_guardian_holds_it_an_output_that_is_on_is_no_doubt(ledger: Ledger) -> None:
    with ledger.hold() as held:
        assert held
        ledger.write("output_on")
        assert ledger.latch() is None
        with ledger.hold() as again:
            assert not again
    assert ledger.latch() is not None


def test_a_holder_that_is_killed_holds_no_more(ledger: Ledger) -> None:
    code = (
        "import sys, time\nfrom workbench.output import Ledger\n"
        "with Ledger(sys.argv[1]).hold() as held:\n    print(held, flush=True)\n    time.sleep(60)"
    )
    words = [sys.executable, "-c", code, ledger.key]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "True\n"
        assert ledger.held()
        holder.kill()
    assert not ledger.held()


def test_a_lost_output_that_was_confirmed_off_later_stands(ledger: Ledger) -> None:
    ledger.write("output_on")
    ledger.write("trip", reason="no answer")
    seen_off(ledger)
    standing = ledger.latch()
    assert standing is not None
    told = r"latched since 20\S+: no answer; the output is off, confirmed"
    assert re.fullmatch(told, standing.description)


@pytest.mark.parametrize("tail", [b'{"event": "tri', b"\x00\x00", b"[1]\n", b'{"acknowled\n'])
def test_a_line_that_cannot_be_read_refuses(ledger: Ledger, tail: bytes) -> None:
    ledger.write("taken")
    seen_off(ledger)
    with ledger.path.open("ab") as file:
        file.write(tail)
    standing = ledger.latch()
    assert standing is not None
    assert "cannot be read" in standing.reason
    assert str(ledger.path) in standing.reason
    seen_off(ledger)  # begins a line of its own, and does not outweigh it
    assert ledger.latch() is not None
    ledger.acknowledge("Grace")
    assert ledger.latch() is None


def test_a_ledger_that_was_emptied_refuses(ledger: Ledger) -> None:
    ledger.write("trip", reason="OVP tripped")
    ledger.path.write_bytes(b"")
    standing = ledger.latch()
    assert standing is not None
    assert "was emptied" in standing.reason
    ledger.acknowledge("Ada")
    assert ledger.latch() is None


def test_a_ledger_that_was_emptied_refuses_whatever_is_written_next(ledger: Ledger) -> None:
    ledger.write("trip", reason="OVP tripped")
    ledger.path.write_bytes(b"")
    ledger.write("taken")
    seen_off(ledger)
    standing = ledger.latch()
    assert standing is not None
    assert "was emptied" in standing.reason


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such files")
@pytest.mark.parametrize("kind", ["folder", "pipe", "endless"])
def test_what_is_no_file_refuses_and_is_not_waited_for(ledger: Ledger, kind: str) -> None:
    ledger.path.parent.mkdir(parents=True, exist_ok=True)
    match kind:
        case "folder":
            ledger.path.mkdir()
        case "pipe":
            os.mkfifo(ledger.path)
        case _:
            ledger.path.symlink_to("/dev/zero")
    standing = ledger.latch()
    assert standing is not None
    assert "cannot be read" in standing.reason
    assert "OUTPUT MAY BE ON" in standing.description
    with pytest.raises(OSError):  # noqa: PT011  each system has its own
        ledger.acknowledge("Ada")


def test_a_lock_that_cannot_be_taken_holds_nobody_from_asking(ledger: Ledger) -> None:
    ledger.write("taken")
    ledger.path.with_suffix(".lock").mkdir()
    assert not ledger.held()
    ledger.ask_for_off()


@pytest.mark.parametrize("line", ["[" * 100_000, '{"event": "off", "n": ' + "9" * 5000 + "}"])
def test_a_line_that_no_reader_takes_damages(ledger: Ledger, line: str) -> None:
    ledger.write("taken")
    ledger.path.write_text(line + "\n", encoding="utf-8")
    standing = ledger.latch()
    assert standing is not None
    assert "cannot be read" in standing.reason


def test_only_the_end_of_a_line_ends_it(ledger: Ledger) -> None:
    ledger.write("trip", reason="OVP tripped")
    ledger.acknowledge("Ada\u2028Lovelace\x85")
    assert ledger.latch() is None


def test_a_request_for_off_is_taken_once(ledger: Ledger) -> None:
    ledger.write("taken")
    assert not ledger.asked_for_off()
    ledger.ask_for_off()
    assert ledger.asked_for_off()
    assert not ledger.asked_for_off()


def test_a_long_ledger_is_read_from_its_end(ledger: Ledger) -> None:
    for _ in range(200):
        ledger.write("note", text="x" * 2000)
    ledger.write("trip", reason="OVP tripped")
    assert ledger.path.stat().st_size > 400_000
    standing = ledger.latch()
    assert standing is not None
    assert standing.reason == "OVP tripped"


def test_the_folder_is_the_system_s_unless_it_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("WORKBENCH_STATE", str(tmp_path / "own"))
    assert Ledger("X").path == tmp_path / "own" / "X.jsonl"
    monkeypatch.delenv("WORKBENCH_STATE")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "home"))
    assert Ledger("X").path.name == "X.jsonl"
    assert "workbench" in Ledger("X").path.parts
