"""The wait for a run's export: refusals are told once and written down, the operator can insist."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from tests.bundles import journal_of, manifest_of
from workbench.bundle import Bundle
from workbench.errors import HardwareError
from workbench.hw import Clock, SimulatedClock, SystemClock
from workbench.run.takes import AnsweredAt, CameraTime, Collector, TakeFolder

Export = Callable[..., Path]
TEN_MINUTES = timedelta(minutes=10)


class Scripted(SimulatedClock):
    """A simulated clock at whose times things happen."""

    def __init__(self) -> None:
        super().__init__()
        self.script: list[tuple[float, Callable[[], object]]] = []

    def sleep(self, seconds: float) -> None:
        super().sleep(seconds)
        while self.script and self.script[0][0] <= self.now():
            self.script.pop(0)[1]()


class Person:
    """An operator who gives prepared answers and remembers what was shown."""

    answered_at: AnsweredAt = "terminal"

    def __init__(self, *answers: object, present: bool = True) -> None:
        self.answers, self.present = list(answers), present
        self.told: list[str] = []
        self.asked: list[str] = []

    def show_text(self, text: str) -> None:
        self.told.append(text)

    def show_picture(self, picture: Path) -> None:
        self.told.append(f"see {picture}")

    def confirm(self, text: str) -> None:
        self.told.append(text)

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        self.asked.append(text)
        answer = self.answers.pop(0)
        if isinstance(answer, BaseException):
            raise answer
        return str(answer)


@pytest.fixture
def clock() -> Scripted:
    return Scripted()


@pytest.fixture
def bundle(tmp_path: Path) -> Bundle:
    return Bundle.create(tmp_path / "runs", "hop", datetime(2026, 3, 12, 16))


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "exports").mkdir()
    return tmp_path / "exports"


def collector(
    bundle: Bundle,
    wanted: CameraTime,
    person: Person,
    clock: Clock,
    used: dict[str, str] | None = None,
) -> Collector:
    used = {} if used is None else used
    return Collector(bundle, wanted, clock.now(), person, clock, tolerance=60.0, used=used)


def events(bundle: Bundle) -> list[str]:
    return [event["event"] for event in journal_of(bundle)]


def move(source: Path, place: Path) -> Path:
    return source.rename(place / source.name)


def interrupt(*words: str) -> None:
    raise KeyboardInterrupt(*words)


def test_takes_of_other_runs_are_told_once_and_the_right_one_is_taken(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    move(export("before.csv"), place)
    folder, person = TakeFolder(place, clock), Person(present=False)
    cut = export("cut.csv")
    cut.write_bytes(cut.read_bytes()[:-300])
    other, short = export("other.csv", wanted.began - TEN_MINUTES), export("short.csv", seconds=2)
    right = export("right.csv")
    clock.script = [
        (10, lambda: move(other, place)),
        (20, lambda: move(short, place)),
        (30, lambda: move(cut, place)),
        (40, lambda: move(right, place)),
    ]
    found = collector(bundle, wanted, person, clock).wait(folder, 1800)
    assert found == place / "right.csv"
    assert clock.now() == pytest.approx(41.5, abs=0.5)
    assert events(bundle) == ["take_wanted", *["take_refused"] * 3, "take_accepted"]
    request, *refusals, note = person.told
    assert request == f"Stop recording and export the take as CSV into {place}."
    for text, name, reason in zip(
        refusals,
        ("other", "short", "cut"),
        ("0:10:00 before this run's cameras", "the take lasts 2.0 s", "the row is cut short"),
        strict=True,
    ):
        assert f"{name}.csv" in text
        assert reason in text
        assert text.endswith("Still waiting.")
    assert note == "by its clock the take began 0.0 s before this run's cameras"
    journal = journal_of(bundle)
    assert journal[1]["reasons"][0].startswith(str(place / "other.csv"))
    assert journal[1]["time_s"] == pytest.approx(11.5, abs=0.5)


def test_an_export_that_was_judged_too_early_is_judged_again(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    whole = export("take.csv").read_bytes()
    path, folder = place / "take.csv", TakeFolder(place, clock)
    clock.script = [
        (5, lambda: path.write_bytes(whole[:9000])),  # the exporter pauses for 15 s
        (20, lambda: path.write_bytes(whole)),
    ]
    assert collector(bundle, wanted, Person(), clock).wait(folder, 60) == path
    assert events(bundle) == ["take_wanted", "take_refused", "take_accepted"]


def test_a_writing_thread_in_real_time_is_waited_for(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime
) -> None:
    data, clock = export("take.csv").read_bytes(), SystemClock()
    folder = TakeFolder(place, clock)

    def write() -> None:
        with (place / "take.csv").open("wb", buffering=0) as file:
            for k in range(0, len(data), len(data) // 5):
                file.write(data[k : k + len(data) // 5])
                time.sleep(0.3)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        found = collector(bundle, wanted, Person(), clock).wait(folder, 20)
    finally:
        writer.join()
    assert found.read_bytes() == data
    assert events(bundle) == ["take_wanted", "take_accepted"]


def test_the_wait_ends_with_what_was_seen(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    folder, other = TakeFolder(place, clock), export("other.csv", wanted.began + TEN_MINUTES)
    clock.script = [(10, lambda: move(other, place))]
    with pytest.raises(HardwareError, match=r"within 30 min, 1 that did not belong$"):
        collector(bundle, wanted, Person(), clock).wait(folder, 1800)
    assert clock.now() == pytest.approx(1800, abs=1)


def test_a_share_that_is_away_for_a_while_is_told_once_and_waited_for(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    folder, person, right = TakeFolder(place, clock), Person(), export("right.csv")
    clock.script = [
        (10, lambda: place.rename(place.with_name("away"))),
        (20, lambda: place.with_name("away").rename(place)),
        (30, lambda: move(right, place)),
    ]
    collector(bundle, wanted, person, clock).wait(folder, 60)
    told = [text for text in person.told if "cannot be listed" in text]
    assert len(told) == 1
    assert told[0].endswith("Still trying.")


def test_ctrl_c_asks_for_a_path_and_nothing_typed_goes_on_watching(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    named = export("named.csv")
    person = Person("", f'"{named}"')
    clock.script = [(5, interrupt), (10, interrupt)]
    found = collector(bundle, wanted, person, clock).wait(TakeFolder(place, clock), 60)
    assert found == named
    assert person.told[0].endswith("Ctrl-C in the terminal, or STOP in the panel.")
    assert person.told[:2] == [person.told[0]] * 2  # said again after the wait goes on
    assert person.asked == [f"Path of the export (nothing: go on watching {place})"] * 2


def test_ctrl_c_gives_up_at_the_question_without_a_person_and_by_a_signal_with_a_name(
    place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    folder = TakeFolder(place, clock)
    clock.script = [(5, interrupt), (10, interrupt), (15, lambda: interrupt("SIGTERM"))]
    for person in (Person(KeyboardInterrupt()), Person(present=False), Person()):
        with pytest.raises(KeyboardInterrupt):
            collector(bundle, wanted, person, clock).wait(folder, 60)
    assert not clock.script
    assert person.asked == []


def test_a_typed_path_is_checked_and_asked_again_with_the_reasons(
    export: Export, tmp_path: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    other, right = export("other.csv", wanted.began - TEN_MINUTES), export("right.csv")
    person = Person("", "yes", other, tmp_path / "gone.csv", "yes", right)
    assert collector(bundle, wanted, person, clock).ask() == right
    assert "give its path" in person.asked[0]
    assert person.asked[1] == person.asked[0]
    assert "yes: cannot be read" in person.asked[2]  # nothing to insist on yet
    assert "0:10:00 before this run's cameras" in person.asked[3]
    assert person.asked[3].endswith("Another path, or yes to take it all the same")
    assert person.asked[4].endswith("Another path")
    assert "yes: cannot be read" in person.asked[5]  # what cannot be read cannot be insisted on
    assert "take_forced" not in manifest_of(bundle)


def test_the_operator_can_insist_and_the_bundle_says_so(
    export: Export, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    short = export("short.csv", seconds=2)
    assert collector(bundle, wanted, Person(short, "Yes"), clock).ask() == short
    assert "the take lasts 2.0 s" in manifest_of(Bundle.open(bundle.path))["take_forced"][0]
    assert events(bundle) == ["take_wanted", "take_refused", "take_forced"]


@pytest.mark.parametrize("name", ["a.csv", "a.row.csv"])
def test_a_recording_shows_one_run_also_when_it_is_exported_again(
    export: Export, place: Path, bundle: Bundle, wanted: CameraTime, clock: Scripted, name: str
) -> None:
    used: dict[str, str] = {}
    first = collector(bundle, wanted, Person(), clock, used).accept(export(name))
    folder, person, again = TakeFolder(place, clock), Person(), export(f"again {name}")
    right = export(f"right {name}", wanted.began + timedelta(seconds=20), seconds=7)
    clock.script = [(10, lambda: move(again, place)), (20, lambda: move(right, place))]
    found = collector(bundle, wanted, person, clock, used).wait(folder, 60)
    assert first.name == name
    assert found == place / right.name
    assert f"this recording shows run {bundle.path.name} already" in person.told[1]


def test_without_a_folder_and_without_a_person_it_says_what_to_configure(
    bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    with pytest.raises(HardwareError, match=r"give the bench file tracking\.takes"):
        collector(bundle, wanted, Person("", present=False), clock).ask()


def test_a_take_that_has_to_belong_is_refused_with_the_reason(
    export: Export, bundle: Bundle, wanted: CameraTime, clock: Scripted
) -> None:
    finder = collector(bundle, wanted, Person(), clock)
    right = export("right.csv")
    assert finder.accept(right) == right
    with pytest.raises(HardwareError, match=r"short\.csv: the take lasts 2\.0 s"):
        finder.accept(export("short.csv", seconds=2))
