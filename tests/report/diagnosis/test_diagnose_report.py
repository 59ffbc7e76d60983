"""The page of a diagnosis: what each answer must show, and that its numbers are the answer's."""

from __future__ import annotations

import json
import re
from dataclasses import fields, replace
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast, get_args

import numpy as np
import pytest

from tests.diagnose.test_missing import DECAY, DRAG, hypothesis
from tests.fit.filmed import ROBOT, measured, twin_motion
from workbench.diagnose import (
    DRIVE,
    Diagnosis,
    DrivePart,
    Errors,
    Kind,
    ObserverPart,
    Part,
    write_answer,
)
from workbench.diagnose.decide import Scored, Versus
from workbench.diagnose.findings import Alternative, Cause, EstimatedQuantity, Refit
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.observer_parts import ObserverParts
from workbench.diagnose.rules import RULES
from workbench.diagnose.screening import Promise
from workbench.fit import Hopper
from workbench.report import write_diagnosis
from workbench.sim import EFFECTS
from workbench.timeseries import TimeSeries

KINDS = get_args(Kind)
TITLES = {
    "NAMED": "Found: air drag",
    "SET": "Possible: air drag or tether",
    "PARTIAL": "Found, but not all of it: air drag",
    "NONE": "No known cause explains the misfit",
    "CLEAN": "The model fits to the noise",
    "DATA_FAULT": "The data are at fault: hop-2",
}
NOWHERE: Any = SimpleNamespace(
    estimator=SimpleNamespace(system=object(), noise={"beam": 1e-4}),
    names=(),
    blocks=(np.ones(4), np.ones(4)),
)
"""A base of another rig: nothing is told of a missing force."""


def scored(*names: str) -> Scored:
    return Scored(names, 0.0, np.ones(8), (np.ones(4),), lambda: 1.5)


def cause(name: str, key: str, unit: str, value: float) -> Cause:
    found = EstimatedQuantity(value, 0.9 * value, 1.1 * value, unit, 0.06 * value)
    return Cause(name, {key: found}, f"{name} of {found}")


def part(kind: Any, best: Scored, *gains: tuple[Scored, float]) -> Part:
    told = tuple((one, Versus(gain, gain / 4, 5.0, 1.0)) for one, gain in gains)
    return Part(kind, best, (best,), 1.5, 0.6, f"{kind} it is", told)


class Regression:
    """A drive whose every quantity is a tolerance, below what is allowed where that is zero."""

    quantities = dict.fromkeys(DRIVE, ())

    def solved(self, names: tuple[str, ...]) -> str:
        return names[0]

    def values(self, names: tuple[str, ...], found: str) -> dict[str, tuple[float, float]]:
        (name,) = names
        assert found == name
        quantities = EFFECTS[name].quantities
        return {f"{name} {q.name}": (q.tolerance, q.tolerance / 4) for q in quantities}


def errors_of(sizes: dict[str, float], ahead: dict[str, float]) -> Errors:
    """Errors of runs that are off by the same all the time."""
    times = np.arange(240) / 120
    off = {run: TimeSeries.of(times, {"top_error_mm": np.full(240, mm)})
           for run, mm in sizes.items()}  # fmt: skip
    still = TimeSeries.of(times, {"top_x_m": np.zeros(240)})
    return Errors(off, dict.fromkeys(sizes, 0.3), "mm", dict.fromkeys(sizes, ahead),
                  dict.fromkeys(sizes, still))  # fmt: skip


def diagnosis(folder: Path, kind: Kind, base: Hypothesis = NOWHERE) -> Diagnosis:
    model = folder / "model.yaml"
    model.write_text("{}")
    drag, tether = cause("air_drag", "c", "N s^2/m^2", 0.02), cause("tether", "pull", "N", 0.01)
    causes = {"NAMED": (drag,), "PARTIAL": (drag,), "SET": (drag, tether)}.get(kind, ())
    best = scored("air_drag") if causes else scored()
    gains = ((scored("air_drag"), 90.0), (scored("tether"), 20.0))
    drive = [(scored(name), float(k)) for k, name in enumerate(DRIVE)]
    ahead = {"0.1": 0.41, "0.5": 0.63, "2": 1.27}
    errors = errors_of({"clamped-9": 2.34, "hop-9": 1.11}, ahead)
    after = errors_of({"clamped-9": 0.52, "hop-9": 1.92}, {"0.1": 0.41, "0.5": 0.63})
    near: Any = None
    fits: Any = SimpleNamespace(
        repeats=lambda channel="": 2.0,
        candidates={"air_drag": SimpleNamespace(separated_by="a plate of known area on T")},
    )
    regression: Any = Regression()
    refit = (
        Refit("top_mass", 0.088, 0.0912, 0.09, 0.0924, "kg", 1.6),
        Refit("root_damping", 0.03, 0.031, 0.02, 0.042, "N m s/rad", 0.1),
    )
    observer = ObserverPart(
        part(kind, best, *gains), causes, base, base, (),
        (Promise("air_drag", 160.0, 3.0, near, {}),), refit, fits,
    )  # fmt: skip
    rig: Any = SimpleNamespace(name="paper robot", source=model)
    fits.rig = SimpleNamespace(base=[SimpleNamespace(name=one.name) for one in refit])
    return Diagnosis(
        rig, kind, causes, "air_drag <b>or</b> nothing",
        (Alternative("root_play", "it is worth less"),),
        ObserverParts({"held foot": observer}, fits),
        DrivePart(part("CLEAN", scored(), *drive), (), regression, ([], [])),
        ("clamped-9", "hop-9"), errors, after, rig,
        (("hop-2", "the rotor turned backwards"),) if kind == "DATA_FAULT" else (), RULES, 51.2,
    )  # fmt: skip


def html_of(folder: Path, found: Diagnosis) -> str:
    path = write_diagnosis(folder / "page.html", found, {"run 1": folder / "model.yaml"},
                         {"numpy": "9.9"}, "Measure next a drop.")  # fmt: skip
    return path.read_text(encoding="utf-8")


def text_of(html: str) -> str:
    """Return what a reader sees, but for the pictures."""
    bare = re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", html, flags=re.DOTALL)
    return " ".join(unescape(bare).split())


@pytest.mark.parametrize("kind", KINDS)
def test_the_answer_and_the_errors_come_first(tmp_path: Path, kind: Kind) -> None:
    found = diagnosis(tmp_path, kind)
    html = html_of(tmp_path, found)
    head = unescape(html[html.index("<header>") : html.index("</header>")])
    assert f"<h1>{TITLES[kind]}</h1>" in head
    assert f"{kind}: paper robot, 2 runs fitted, 2 held out" in head
    assert "the model's error is 1.83 mm, the extended one's 1.41 mm" in head
    assert "noise alone makes 0.300 mm" in head
    assert ("Air_drag of 0.0200 N s^2/m^2" in head) == (kind in ("NAMED", "PARTIAL"))


def test_sections_come_in_their_order(tmp_path: Path) -> None:
    titles = re.findall(r"<h2>(.*?)</h2>", html_of(tmp_path, diagnosis(tmp_path, "NAMED")))
    assert titles == [
        "Warnings", "Error on the runs held out", "Size of the cause", "Gain of each candidate",
        "Alternatives, and why they are out", "What the refit changed", "The drive",
        "What to do next", "Rules", "Made from",
    ]  # fmt: skip


def test_numbers_are_those_of_the_answer(tmp_path: Path) -> None:
    text = text_of(html_of(tmp_path, diagnosis(tmp_path, "NAMED")))
    assert "0.1 s ahead, all of them 0.410 0.410 0.300" in text
    assert "2 s ahead, all of them 1.27 0.300 Root" in text, "where nothing was predicted, nothing"
    assert "air drag c 0.0200 0.0180 to 0.0220 N s^2/m^2" in text
    assert "top mass 0.0880 0.0912 0.0900 to 0.0924 kg +1.60" in text
    assert "speed scale share 0.500 0.294 to 0.706 % 0 0" in text
    assert "hop-9 speaks against the answer" in text
    assert "Measure next a drop." in text
    assert "What shows whether it is air drag: a plate of known area on T." in text


def test_promises_count_as_gains_do(tmp_path: Path) -> None:
    html = html_of(tmp_path, diagnosis(tmp_path, "NAMED"))
    assert "gain in log-likelihood over the base" in html
    assert "threshold 16.0" in html
    assert html.index(">air drag<") < html.index(">tether<")


def test_every_rule_stands_there_with_its_words(tmp_path: Path) -> None:
    text = text_of(html_of(tmp_path, diagnosis(tmp_path, "CLEAN")))
    rules = text[text.index(" Rules ") :]
    for one in fields(RULES):
        assert f" {one.name} {getattr(RULES, one.name):g} " in rules
    assert "candidates that are fitted in full" in rules


def test_words_of_others_are_no_markup(tmp_path: Path) -> None:
    html = html_of(tmp_path, diagnosis(tmp_path, "SET"))
    assert "&lt;b&gt;or&lt;/b&gt;" in html
    assert "<b>" not in html


def test_what_is_not_there_is_left_out(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, "CLEAN")
    (observer,) = found.observer.parts.values()
    found.observer.fits.rig = cast(Any, SimpleNamespace(base=[]))
    alone = ObserverParts(
        {"held foot": replace(observer, promises=(), refit=())}, found.observer.fits
    )
    bare = replace(found, observer=alone, drive=None, errors=None, extended_errors=None,
                   extended=None, held_out=())  # fmt: skip
    html = html_of(tmp_path, bare)
    assert "no run was held out" in html
    for title in ("The drive", "Error on the runs", "What the refit", "The missing force"):
        assert f"<h2>{title}" not in html


def test_the_same_diagnosis_gives_the_same_bytes(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, "NAMED")
    assert html_of(tmp_path, found) == html_of(tmp_path, found)


def test_the_missing_force_of_a_robot_is_told_and_drawn(tmp_path: Path) -> None:
    system = Hopper(ROBOT, [measured(twin_motion(DECAY, DRAG), DECAY)])
    html = html_of(tmp_path, diagnosis(tmp_path, "NONE", hypothesis(system)))
    section = html[html.index("<h2>The missing force</h2>") :]
    assert "A force at T against the motion" in section
    assert "with the square of speed" in section
    assert section.count("<svg", 0, section.index("Gain of each candidate")) == 2


def test_the_answer_is_written_as_it_is_printed(tmp_path: Path) -> None:
    found = diagnosis(tmp_path, "NAMED")
    write_answer(tmp_path / "answer.json", found.as_json(), {})
    told = json.loads((tmp_path / "answer.json").read_text())
    assert told["answer"] == "NAMED"
    assert told["causes"][0]["parameters"]["c"]["value"] == 0.02
    assert told["rules"]["least_gain"] == RULES.least_gain
