"""The page of a diagnosis: what each answer must show, and that its numbers are the answer's."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.conftest import Command
from tests.diagnose.paper import CAUSES, NOISE_M, PaperRig, cause, half_understood, measured
from tests.pendulum import PENDULUMS, rig_of
from workbench.cli.diagnose import show_diagnosis
from workbench.diagnose import Diagnosis, diagnose, write_diagnosis
from workbench.diagnose.figures import label, spectrum_figure, trace_figure
from workbench.diagnose.leftover import Trace, density, left_by_run, worst_traces
from workbench.diagnose.wording import digits

TIMES = np.arange(600) / 100
STRANGER = 1e-3 * np.sign(np.sin(23 * TIMES)) * np.sin(2 * TIMES)
"""What no cause explains [m]; it turns at 3.66 Hz."""

RIGS: dict[str, PaperRig] = {
    "NAMED": measured(1, {"hardening": 0.01}),
    "SET": replace(measured(3, {"wobble": 0.5}), causes=(*CAUSES, cause("wobble_again"))),
    "NONE": measured(4, stranger=STRANGER),
    "CLEAN": measured(2),
    "DATA_FAULT": measured(5, {"scale": 0.05}),
}
TITLES = {
    "NAMED": "Found: hardening",
    "SET": "Possible: wobble again or wobble",
    "NONE": "No known cause explains the misfit",
    "CLEAN": "Nothing is wrong above the noise",
    "DATA_FAULT": "The data are at fault: scale",
}
EXTENDS = ("NAMED", "SET", "DATA_FAULT")


class Page(NamedTuple):
    found: Diagnosis
    html: str

    @property
    def text(self) -> str:
        """What a reader sees, but for the pictures."""
        bare = re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", self.html, flags=re.DOTALL)
        return " ".join(unescape(bare).split())


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Page]:
    folder = tmp_path_factory.mktemp("pages")
    (folder / "paper.json").write_text("{}")
    made = {}
    for kind, rig in RIGS.items():
        found = diagnose(replace(rig, source=folder / "paper.json"), folder / kind, kind, seed=7)
        assert found.answer.kind == kind
        files = {"run 0": folder / "paper.json"}
        path = write_diagnosis(folder / kind / f"{kind}.html", found, files, {"numpy": "9.9"})
        made[kind] = Page(found, path.read_text(encoding="utf-8"))
    return made


@pytest.mark.parametrize("kind", RIGS)
def test_the_answer_and_the_errors_come_first(pages: dict[str, Page], kind: str) -> None:
    found, html = pages[kind]
    words = found.as_json()
    head = unescape(html[html.index("<header>") : html.index("</header>")])
    assert f"<h1>{TITLES[kind]}</h1>" in head
    assert f"{kind}: paper, 3 runs fitted, 1 held out" in head
    rmse = words["rmse_mm"]
    assert f"the model errs by {digits(rmse['base'])} mm" in head
    assert f"noise alone makes {digits(rmse['noise_floor'])} mm" in head
    assert (f"the extended one by {digits(rmse['extended'])} mm" in head) == (kind in EXTENDS)
    if kind in ("NAMED", "DATA_FAULT"):
        assert words["causes"][0]["sentence"][1:] in head
    else:
        assert words["reason"].replace("_", " ")[1:] in head


@pytest.mark.parametrize("kind", RIGS)
def test_the_tables_hold_the_numbers_of_the_answer(pages: dict[str, Page], kind: str) -> None:
    found, html = pages[kind]
    words = found.as_json()
    rows = [
        [unescape(cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)]
        for row in re.findall(r"<tr>(.*?)</tr>", html)
    ]
    shown = ["base", "extended"] if kind in EXTENDS else ["base"]
    assert ["run_3", *(digits(words["rmse_mm"][model]) for model in shown)] in rows
    for one in words["causes"]:
        quantity = one["parameters"]["amount"]
        low, high = quantity["interval90"]
        assert [
            one["effect"].replace("_", " "), f"{100 * one['confidence']:.0f} %", "amount",
            digits(100 * quantity["value"]), f"{digits(100 * low)} to {digits(100 * high)}", "%",
        ] in rows  # fmt: skip
    for rival in words["rivals"]:
        assert [rival["effect"].replace("_", " "), rival["why_not"].replace("_", " ")] in rows
    for left in left_by_run(found):
        sizes = [*left.before.values(), *left.after.values()]
        role = "held out" if left.role == "held_out" else "fitted"
        assert [f"{left.run} (swing, {role})", *(f"{size:.2f}" for size in sizes)] in rows


@pytest.mark.parametrize("kind", RIGS)
def test_the_page_tells_what_is_left_and_what_to_do(pages: dict[str, Page], kind: str) -> None:
    found, html = pages[kind]
    text = pages[kind].text
    assert (
        f"{digits(found.refits.base.left)} noise deviations of the runs fitted hang together"
        in text
    )
    assert ("something else is at work" in text) == (kind == "NONE")
    advice = {
        "NAMED": "Look for the cause at the machine",
        "SET": "these runs cannot decide",
        "NONE": "change one thing at a time",
        "CLEAN": "as good as these runs can tell",
        "DATA_FAULT": "Put the measurement right",
    }
    assert [kind for kind, words in advice.items() if words in text] == [kind]
    assert ("The extended model:" in text) == (kind in EXTENDS)
    assert html.count("<svg") == 3


def test_where_the_strange_motion_is_most_is_told(pages: dict[str, Page]) -> None:
    """It grows with the run's size, and so is largest in run 2."""
    text = pages["NONE"].text
    assert "Most is left of x in run_2" in text
    found = re.search(r"x of run_3 exceeds its noise most at ([\d.]+) Hz", text)
    assert found is not None
    assert float(found[1]) == pytest.approx(23 / (2 * np.pi), abs=0.5)
    assert "exceeds its noise" not in pages["NAMED"].text
    assert "exceeds its noise" not in pages["CLEAN"].text


def test_provenance_has_hashes_seed_and_versions(pages: dict[str, Page]) -> None:
    found, text = pages["NAMED"].found, pages["NAMED"].text
    assert found.extended is not None
    for path in (found.rig.source, found.extended.source):
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        assert f"{path}, sha256 {digest}" in text
    assert "seed 7" in text
    assert "numpy 9.9" in text


def test_a_cause_that_is_not_all_says_so_first(pages: dict[str, Page], tmp_path: Path) -> None:
    (tmp_path / "paper.json").write_text("{}")
    found = diagnose(replace(half_understood(), source=tmp_path / "paper.json"), tmp_path)
    html = write_diagnosis(tmp_path / "page.html", found, {}, {}).read_text(encoding="utf-8")
    assert "<h1>Found, but not all of it: creep</h1>" in html
    assert "<li>Something else is wrong as well, or instead. Look at the machine where" in html
    assert not any("not all of it" in page.html for page in pages.values())
    assert not any("Something else is wrong" in page.html for page in pages.values())


@pytest.mark.parametrize("kind", RIGS)
def test_the_page_stands_alone_in_light_and_dark(pages: dict[str, Page], kind: str) -> None:
    html = pages[kind].html
    assert not re.search(r"https?:|src=|<script|<link|@import|url\((?!#)", html)
    assert "prefers-color-scheme: dark" in html
    assert "currentColor" in html
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert len(ids) == len(set(ids))


def test_the_same_diagnosis_gives_the_same_page(pages: dict[str, Page], tmp_path: Path) -> None:
    found, html = pages["NAMED"]
    files = {"run 0": found.rig.source}
    again = write_diagnosis(tmp_path / "again.html", found, files, {"numpy": "9.9"})
    assert again.read_text(encoding="utf-8") == html


def test_a_proposed_run_is_the_first_thing_to_do(pages: dict[str, Page], tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    write_diagnosis(path, pages["SET"].found, {}, {}, "Pull <harder>")
    html = path.read_text(encoding="utf-8")
    assert "<ul><li>Pull &lt;harder&gt;</li><li>Do not mend anything yet" in html


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (0.5, 0.6, "run_3 speaks against the answer: the extension errs by 0.600 mm where"),
        (0.5, 0.31, None),
        (0.5, 0.505, None),  # by chance
        (0.2, 0.21, None),  # both are below the noise
        (1.5, 0.7, "run_3 is not understood: 0.700 mm are left of it where noise makes 0.310 mm"),
    ],
)
def test_runs_held_out_that_speak_against_the_answer_are_a_warning(
    pages: dict[str, Page], tmp_path: Path, before: float, after: float, words: str | None
) -> None:
    found = pages["SET"].found
    assert found.proof is not None
    assert "Warnings" not in pages["SET"].text
    base = replace(found.errors, by_run={"run_3": before}, noise_floor=0.31)
    extended = replace(found.proof.extended, by_run={"run_3": after})
    doubted = replace(found, errors=base, proof=replace(found.proof, extended=extended))
    html = write_diagnosis(tmp_path / "page.html", doubted, {}, {}).read_text(encoding="utf-8")
    assert ('<ul class="warnings">' in html) == (words is not None)
    assert words is None or words in html


def test_names_of_runs_held_out_are_not_folded(
    pages: dict[str, Page], capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("2026-11-25_070710_clamped-clamped-5", "2026-11-25_070714_hop-hop-3")
    show_diagnosis(replace(pages["NAMED"].found, held_out=names))
    said = capsys.readouterr()
    assert f"held out: {', '.join(names)}\n" in said.err
    assert said.out.splitlines()[0].strip() == "error on runs held out"


def test_runs_compared_in_part_are_a_warning(pages: dict[str, Page], tmp_path: Path) -> None:
    found = replace(pages["SET"].found, shortened=(("run_0", 1.0), ("run_2", 2.5)))
    html = write_diagnosis(tmp_path / "page.html", found, {}, {}).read_text(encoding="utf-8")
    words = "compared only for as long as the base follows them: run_0 for 1.00 s, run_2 for 2.50 s"
    assert f'<ul class="warnings"><li>{words}</li></ul>' in html


def test_what_is_left_is_the_error_over_the_noise(pages: dict[str, Page]) -> None:
    """The noise is white here, so whitening changes nothing."""
    found = pages["SET"].found
    rows = left_by_run(found)
    assert [row.run for row in rows] == ["run_0", "run_1", "run_2", "run_3"]
    assert [row.role for row in rows] == ["train", "train", "train", "held_out"]
    assert float(found.noise[3].memory[0]) == 0.0
    sigma_mm = 1000 * float(found.noise[3].sigma[0])
    assert rows[3].before["x_m"] == pytest.approx(found.errors.by_run["run_3"] / sigma_mm)
    wobble = 0.5e-3 / np.sqrt(2) / NOISE_M  # noise deviations, in every run
    for row in rows:
        assert row.before["x_m"] == pytest.approx(np.hypot(1, wobble), rel=0.06)
        assert row.after["x_m"] == pytest.approx(1.0, abs=0.08)
    assert all(row.after == {} for row in left_by_run(pages["NONE"].found))


def test_the_trace_is_the_run_held_out_as_both_models_have_it(pages: dict[str, Page]) -> None:
    found = pages["NAMED"].found
    (trace,) = worst_traces(found, 2)
    assert (trace.run, trace.channel) == ("run_3", "x_m")
    assert trace.extended is not None
    assert found.proof is not None
    for predicted, errors in ((trace.base, found.errors), (trace.extended, found.proof.extended)):
        error = 1000 * float(np.sqrt(np.mean((trace.measured - predicted) ** 2)))
        assert error == pytest.approx(errors.by_run["run_3"], rel=1e-12)


def line(hidden: bool = True, memory: float = 0.0) -> Trace:
    """Noise of 0.3 mm that may remember, and 1 mm at 7 Hz that the base lacks; 0.2 s not seen."""
    rng, times = np.random.default_rng(3), np.arange(6000) / 100
    noise = np.empty(len(times))
    noise[0] = rng.standard_normal()
    for k, fresh in enumerate(rng.standard_normal(len(times) - 1), start=1):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * fresh
    sine = 1e-3 * np.sin(2 * np.pi * 7 * times) * hidden
    measured = sine + NOISE_M * noise
    measured[1000:1020] = np.nan
    still = np.zeros(len(times))
    return Trace("run", "x_m", "m", times, measured, still, sine, NOISE_M, memory)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_a_spectrum_shows_the_line_over_the_level_of_the_noise(memory: float) -> None:
    one = density(line(memory=memory))
    assert one.after is not None
    assert one.hz[np.argmax(one.before)] == pytest.approx(7.0, abs=0.05)
    moving = one.hz > 0.1
    level = np.sqrt(np.mean((one.after / one.noise)[moving] ** 2))
    assert level == pytest.approx(1.0, abs=0.05)
    if not memory:  # white: the variance over half the rate
        assert one.noise == pytest.approx(NOISE_M * np.sqrt(2 / 100), rel=1e-9)
    assert one.peak_hz is None
    base_only = density(replace(line(memory=memory), extended=None))
    assert base_only.peak_hz == pytest.approx(7.0, abs=0.05)


def test_lengths_are_drawn_in_millimetres_and_the_band_is_twice_the_noise() -> None:
    trace = line()
    near, left = trace_figure([trace]).axes
    assert near.get_ylabel() == "[mm]"
    assert left.get_ylabel() == "left [mm]"
    shown = near.lines[0]
    assert np.ptp(np.asarray(shown.get_xdata(), dtype=float)) == pytest.approx(2 / 7, abs=0.02)
    band = np.asarray(near.collections[0].get_paths()[0].vertices)
    first = band[np.isclose(band[:, 0], np.asarray(shown.get_xdata(), dtype=float)[0])][:, 1]
    assert np.ptp(first) == pytest.approx(4 * 1000 * NOISE_M)
    (spectrum,) = spectrum_figure([trace], [density(trace)]).axes
    assert spectrum.get_ylabel() == "left [mm/\N{SQUARE ROOT}Hz]"
    angles = trace_figure([replace(trace, unit="rad")]).axes
    assert angles[0].get_ylabel() == "[rad]"


def test_channels_and_numbers_are_written_for_people() -> None:
    assert [label(name) for name in ("top_x_m", "rotor_angle_rad", "place", "mark_2")] == [
        "top x", "rotor angle", "place", "mark 2",
    ]  # fmt: skip
    numbers = (0.0, 0.35, 99.96, 2989.6, -0.5, 0.003987, 1.2e-7, 4.5e7)
    assert [digits(number) for number in numbers] == [
        "0", "0.350", "100", "2990", "-0.500", "0.00399", "1.20e-07", "4.50e+07",
    ]  # fmt: skip


@pytest.mark.parametrize("name", PENDULUMS)
def test_the_command_line_writes_the_page_and_names_it(
    workbench: Command, tmp_path: Path, name: str
) -> None:
    rig = rig_of(name, tmp_path)
    answer = workbench("diagnose", "--rig", rig, "--out", tmp_path / "swing", "--json")
    assert answer.code == 0
    assert answer.json["report"] == str(tmp_path / "swing" / "swing.html")
    html = Path(answer.json["report"]).read_text(encoding="utf-8")
    assert "Base [rad]" in html
    assert f"errs by {digits(answer.json['rmse_mm']['base'])} rad" in html
    assert "release-0.9.csv, sha256" in html
    assert "pendulum.xml, sha256" in html
