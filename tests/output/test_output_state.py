"""The fold over what happened to an output: no verdict is older than the deed."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.output import MAY_BE_ON, OutputState, after, fold

Event = dict[str, Any]

ON, OFF, NOT_OFF = (
    {"event": "output_on"},
    {"event": "off", "confirmed": True},
    {"event": "off", "confirmed": False},
)
DEAD, LIVE = {"event": "terminals", "dead": True}, {"event": "terminals", "dead": False}
TAKEN, REGAINED = {"event": "taken"}, {"event": "regained"}
LOST = {"event": "lost", "cause": "no answer"}
TRIP = {"event": "trip", "reason": "its client is dead"}
EVERY = (ON, OFF, NOT_OFF, DEAD, LIVE, TAKEN, REGAINED, LOST, TRIP, {"event": "armed"})


@pytest.mark.parametrize(
    ("events", "state", "words"),
    [
        ([], "untouched", "nothing was switched: its output is as it was before"),
        ([TAKEN], "unknown", f"{MAY_BE_ON} (its state was not yet known when the record ended)"),
        ([TAKEN, OFF], "unknown", MAY_BE_ON),
        ([TAKEN, OFF, DEAD], "off", "the output is off, confirmed"),
        ([TAKEN, OFF, DEAD, ON], "on", f"{MAY_BE_ON} (it was switched on, and off was not"),
        ([TAKEN, OFF, DEAD, ON, OFF], "on", MAY_BE_ON),
        ([TAKEN, OFF, DEAD, ON, OFF, LIVE], "unknown", "its terminals are live"),
        ([TAKEN, OFF, DEAD, ON, NOT_OFF], "unknown", "off was sent and not read back"),
        ([TAKEN, OFF, DEAD, ON, LOST, NOT_OFF], "unknown", f"{MAY_BE_ON} (no answer)"),
        ([TAKEN, OFF, DEAD, ON, LOST, REGAINED], "on", MAY_BE_ON),
        ([TAKEN, OFF, DEAD, ON, OFF, LOST, REGAINED, DEAD], "off", "confirmed"),
        ([TAKEN, OFF, DEAD, TAKEN], "unknown", "its state was not yet known"),
        ([ON, LOST, TRIP, NOT_OFF, OFF, DEAD], "off", "confirmed"),
        ([ON, DEAD], "on", MAY_BE_ON),  # dead terminals of an output that is on prove nothing
        ([ON, OFF, ON, DEAD], "on", MAY_BE_ON),
        ([{"event": "no_drive"}], "not driven", "the supply was not opened"),
        ([ON, {"event": "output_off", "confirmed": True}], "off", "confirmed"),
        ([ON, {"event": "output_off", "confirmed": False}], "unknown", MAY_BE_ON),
        ([TAKEN, OFF, DEAD, {"event": "damaged", "cause": "cut"}], "unknown", f"{MAY_BE_ON} (cut)"),
    ],
)
def test_what_is_known_after(events: list[Event], state: str, words: str) -> None:
    known = fold(events)
    assert known.state == state
    assert words in known.description


@dataclass
class Supply:
    """A supply that does what it is told, or not, and the record that is written beside it.

    A crash may come between any two lines of `record` and `on`: `moments` has both at each.
    """

    on: bool = False
    record: list[Event] = field(default_factory=list)
    moments: list[tuple[list[Event], bool]] = field(default_factory=list)

    def write(self, event: Event) -> None:
        self.record = [*self.record, event]
        self.moments.append((self.record, self.on))

    def become(self, on: bool) -> None:
        self.on = on
        self.moments.append((self.record, self.on))

    def act(self, deed: str) -> None:
        """Carry out one deed as a guardian does: on is written first, off afterwards."""
        match deed:
            case "on":
                self.write(ON)
                self.become(True)
            case "on, ignored":
                self.write(ON)
            case "off":
                self.become(False)
                self.write(OFF)
                self.write(DEAD)
            case "off, ignored":
                self.write(NOT_OFF)
            case "off, a flag that lies":
                self.write(OFF)
                self.write(LIVE if self.on else DEAD)
            case "lost":
                self.write(LOST)
            case "regained":
                self.write(REGAINED)
            case "switched on at its front, then the next program":
                self.on = True  # nothing is said of a supply that no program drives
                self.record = [*self.record, TAKEN]
                self.moments.append((self.record, self.on))
            case _:
                self.write(TRIP)


DEEDS = (
    "on",
    "on, ignored",
    "off",
    "off, ignored",
    "off, a flag that lies",
    "lost",
    "regained",
    "switched on at its front, then the next program",
    "trip",
)


def check(found_on: bool, deeds: tuple[str, ...]) -> int:
    """Crash at every moment: "off" is told only of a supply that is off. Return how many."""
    supply = Supply(found_on)
    supply.moments.append(([], found_on))
    supply.write(TAKEN)
    for deed in deeds:
        supply.act(deed)
    for record, on in supply.moments:
        known = fold(record)
        assert not (known.state == "off" and on), (record, on)
        assert (MAY_BE_ON in known.description) == known.live
        assert not (known.verdict == "confirmed" and on)
    return len(supply.moments)


def test_every_prefix_and_crash_point_of_every_order_of_four_deeds() -> None:
    moments = sum(
        check(found_on, deeds)
        for found_on in (False, True)
        for length in range(5)
        for deeds in itertools.product(DEEDS, repeat=length)
    )
    assert moments > 50_000


@given(st.booleans(), st.lists(st.sampled_from(DEEDS), max_size=40))
def test_long_histories(found_on: bool, deeds: list[str]) -> None:
    check(found_on, tuple(deeds))


@given(st.lists(st.sampled_from(EVERY), max_size=30))
def test_whatever_comes_in_whatever_order_only_off_and_dead_after_the_last_on_is_off(
    events: list[Event],
) -> None:
    known, seen_off, read_back = OutputState(), False, False
    for event in events:
        known = after(known, event)
        name = event["event"]
        if name == "output_on" or event in (NOT_OFF, LIVE):
            seen_off = read_back = False
        elif event == OFF:
            read_back = True
        elif event == DEAD and read_back:
            seen_off = True
        assert not (known.state == "off" and not seen_off)


def test_the_first_cause_stays() -> None:
    second = {"event": "lost", "cause": "the port is gone"}
    assert fold([ON, LOST, second, NOT_OFF, TRIP]).cause == "no answer"
