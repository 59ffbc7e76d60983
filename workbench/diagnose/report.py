"""The report of a diagnosis: one page that says what is wrong, how surely, and what is gained."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from workbench.bundle import sha256
from workbench.diagnose.answer import Kind, negligible
from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.figures import label, score_figure, spectrum_figure, trace_figure
from workbench.diagnose.hopper import HopperRig
from workbench.diagnose.hops import hop_table
from workbench.diagnose.leftover import RunLeft, density, left_by_run, worst_traces
from workbench.diagnose.proof import HARM
from workbench.diagnose.wording import digits
from workbench.review.drawing import as_svg
from workbench.review.page import code, figure, heat_table, picture, table, warning_list, write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["write_diagnosis"]

_MOST_CHANNELS = 2  # that are drawn; the table has all
_DOUBTFUL = 2.0  # times the noise: a run held out that errs more is not understood
_HOTTEST = 10.0  # noise deviations that get the deepest colour
_HEADLINES: dict[Kind, str] = {
    "NAMED": "Found: {causes}",
    "SET": "Possible: {causes}",
    "NONE": "No known cause explains the misfit",
    "CLEAN": "Nothing is wrong above the noise",
    "DATA_FAULT": "The data are at fault: {causes}",
}
_ADVICE: dict[Kind, str] = {
    "NAMED": "Look for the cause at the machine. Where it is to stay, go on with the extended "
    "model; where it is mended, measure again.",
    "SET": "Do not mend anything yet: these runs cannot decide. Measure runs that differ more.",
    "NONE": "Look at the machine where and when most is left, change one thing at a time, measure "
    "again. The model stays as it is.",
    "CLEAN": "Nothing: the model is as good as these runs can tell. Only runs of other modes, or "
    "with larger motion, would ask more of it.",
    "DATA_FAULT": "Put the measurement right and measure again before anything of the machine is "
    "changed.",
}
_NOT_ALL = ", but not all of it:"  # in a headline, where most of the misfit is left
_ELSE = "Something else is wrong as well, or instead. Look at the machine where most is left."
_ROLES = {"train": "fitted", "held_out": "held out"}


def write_diagnosis(
    path: Path,
    found: Diagnosis,
    files: Mapping[str, Path],
    versions: Mapping[str, str],
    next_run: str | None = None,
    moving: bytes | None = None,
) -> Path:
    """Write a diagnosis as one HTML page and return its path; the same one gives the same bytes.

    Args:
        path: the `.html` file; one that is there is replaced.
        found: the diagnosis.
        files: what it was made from, by what each is to it.
        versions: of what it was made with, by name.
        next_run: in a sentence, what to measure next; None where nothing was proposed.
        moving: JPEG of the viewer with `found.worst_held_out` and its twins; None without one.
    """
    words = found.as_json()
    fitted, held = len(found.refits.base.fit.linear.runs), len(found.held_out)
    about = f"{words['answer']}: {found.rig.name}, {fitted} runs fitted, {held} held out"
    sizes = "Size of the causes" if len(words["causes"]) > 1 else "Size of the cause"
    sections = [
        ("Warnings", warning_list(_warnings(found))),
        ("Error on the runs held out", _errors(found, words)),
        (sizes, _causes(found, words)),
        ("The misfit", _misfit(found)),
        ("Later hops", hop_table(found)),
        ("What each cause is worth", _scores(found)),
        ("Rivals, and why they fell", _rivals(found, words)),
        ("Not shown by these runs", _silent(found)),
        ("Still unexplained", _unexplained(found)),
        ("Recording", _recording(found, moving)),
        ("What to do next", _list(_next_steps(found, next_run))),
        ("Made from", _provenance(found, files, versions)),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_page(path, _headline(words), about, _verdict(found, words), sections)
    return path


def _headline(words: Mapping[str, Any]) -> str:
    causes = " and ".join(_spoken(cause["effect"]) for cause in words["causes"])
    if words["answer"] == "SET":
        causes = causes.replace(" and ", " or ")
    headline = _HEADLINES[words["answer"]].format(causes=causes).removesuffix(": ")
    return headline if words["adequate"] is not False else headline.replace(":", _NOT_ALL, 1)


def _verdict(found: Diagnosis, words: Mapping[str, Any]) -> str:
    """Return the causes in sentences, or the reason for none, and the errors."""
    sentences = [_spoken(words["reason"])]
    if _is_sure(words):
        sentences = [cause["sentence"] for cause in words["causes"]]
    rmse, unit = words["rmse_mm"], found.errors.unit
    gain = f"On runs that no fit has seen, the model errs by {digits(rmse['base'])} {unit}"
    if found.proof is not None:
        gain += f" and the extended one by {digits(rmse['extended'])} {unit}"
    floor = f"noise alone makes {digits(rmse['noise_floor'])} {unit}"
    return " ".join(f"{_sentence(one)}." for one in (*sentences, f"{gain}; {floor}"))


def _is_sure(words: Mapping[str, Any]) -> bool:
    """Tell whether the causes are named; else the reason stands in the verdict."""
    return bool(words["causes"]) and words["answer"] != "SET"


def _warnings(found: Diagnosis) -> Iterator[str]:
    """Yield which runs count in part or not at all, and where those held out speak against it."""
    for run, evidence in found.sound.evidence:
        yield f"{run} is left out: {evidence}"
    if found.in_part is not None:
        yield found.in_part
    base, unit = found.errors, found.errors.unit
    last = base if found.proof is None else found.proof.extended
    for name in found.held_out if found.answer.kind != "NONE" else ():
        before, after = base.by_run[name], last.by_run[name]
        if after > max((1 + HARM) * before, base.noise_floor):
            yield (
                f"{name} speaks against the answer: the extension errs by {digits(after)} {unit} "
                f"where the base errs by {digits(before)} {unit}"
            )
        elif after > _DOUBTFUL * base.noise_floor:
            yield (
                f"{name} is not understood: {digits(after)} {unit} are left of it where noise "
                f"makes {digits(base.noise_floor)} {unit}"
            )


def _errors(found: Diagnosis, words: Mapping[str, Any]) -> Markup:
    unit, rmse = found.errors.unit, words["rmse_mm"]
    models = {"Base": (found.errors, rmse["base"])}
    if found.proof is not None:
        models["Extended"] = (found.proof.extended, rmse["extended"])
    rows = [
        (name, *(digits(errors.by_run[name]) for errors, _ in models.values()))
        for name in found.held_out
    ]
    if len(rows) > 1:
        rows.append(("all of them", *(digits(error) for _, error in models.values())))
    rows.append(("noise alone", *(digits(rmse["noise_floor"]) for _ in models)))
    errors = table(rows, ("Run", *(f"{name} [{unit}]" for name in models)))
    if found.proof is None:
        return errors
    share = f"{100 * words['removable_removed']:.0f} %"
    return errors + Markup(
        "<p>Root mean square. The extension removes {} of what exceeds the noise.</p>"
    ).format(share)


def _causes(found: Diagnosis, words: Mapping[str, Any]) -> Markup:
    heads = ("Cause", "Confidence", "Quantity", "Value", "90 % interval", "Unit")
    rows = [
        (_spoken(cause["effect"]), f"{100 * cause['confidence']:.0f} %", quantity,
         digits(value), f"{digits(low)} to {digits(high)}", unit)
        for cause in words["causes"]
        for quantity, one in found.quantities[cause["effect"]].items()
        for value, low, high, unit in (one.told,)
    ]  # fmt: skip
    several = words["causes"] if words["answer"] == "SET" else []
    sentences = _list(_sentence(cause["sentence"]) + "." for cause in several)
    return table(rows, heads) + sentences if rows else sentences


def _misfit(found: Diagnosis) -> Markup:
    """Return traces, spectra and the table of what is left."""
    drawn = Markup()
    traces = worst_traces(found, _MOST_CHANNELS)
    if traces:
        drawn = _drawn(trace_figure(traces), "traces", (
            "The run held out that the base misses most, above where it misses it most. Below: "
            "measured less predicted; grey is what is shown above. Bands: twice the noise."
        )) + _drawn(spectrum_figure(traces, [density(trace) for trace in traces]), "spectra", (
            "What is left of the same run over frequency. Well above the grey it is no noise."
        ))  # fmt: skip
    return drawn + _heat(left_by_run(found))


def _heat(rows: list[RunLeft]) -> Markup:
    channels = list(dict.fromkeys(name for row in rows for name in row.before))
    sides = ("before", "after") if any(row.after for row in rows) else ("left",)
    groups = [(label(name), len(sides)) for name in channels]
    numbers = [
        (f"{row.run} ({row.mode}, {_ROLES[row.role]})", [
            side.get(name, np.nan)
            for name in channels
            for side in (row.before, row.after)[: len(sides)]
        ])
        for row in rows
    ]  # fmt: skip
    words = Markup(
        "<p>Root mean square of what is left, in noise deviations; 1 is noise alone.</p>"
    )
    return words + heat_table(numbers, ("Run", *sides * len(channels)), groups, _HOTTEST)


def _scores(found: Diagnosis) -> Markup:
    if not found.refits.scores:
        return Markup()
    caption = (
        "Bars: what a cause promises beside small errors of all others. Diamonds: what it, or two "
        "together, reached when all fitted runs were simulated with it. Green: taken. Less than "
        "the threshold may be chance."
    )
    return _drawn(score_figure(found), "scores", caption)


def _rivals(found: Diagnosis, words: Mapping[str, Any]) -> Markup:
    silent = found.refits.base.near.silent
    told = Markup()
    if _is_sure(words):
        told = Markup("<p>{}.</p>").format(_sentence(_spoken(words["reason"])))
    rows = [
        (_spoken(rival["effect"]), _spoken(rival["why_not"]))
        for rival in words["rivals"]
        if rival["effect"] not in silent
    ]
    return told + table(rows, css="facts") if rows else told


def _silent(found: Diagnosis) -> Markup:
    """Return the causes that these runs do not show, by the modes of runs that would."""
    by_modes: dict[str, list[str]] = {}
    for name in found.refits.base.near.silent:
        modes = ", ".join(found.layout.causes[name].shows_in) or "no run of these modes"
        by_modes.setdefault(modes, []).append(_spoken(name))
    rows = [(modes, ", ".join(names)) for modes, names in by_modes.items()]
    return table(rows, ("Shows in", "Causes"), css="facts") if rows else Markup()


def _unexplained(found: Diagnosis) -> Markup:
    base, best, limit = found.refits.base, found.answer.best, negligible(found.refits)
    left = f"{digits(base.left)} noise deviations of the runs fitted hang together in time; "
    if best.causes:
        left += f"{' with '.join(map(_spoken, best.causes))} leaves {digits(best.left)} of them; "
    left += f"small errors of all causes together leave {digits(best.beyond)}. "
    left += (
        f"Chance leaves {digits(limit)} at most: something else is at work."
        if best.beyond > limit
        else f"Chance may leave {digits(limit)}: these runs tell nothing more."
    )
    return _list([left, *_where_left(found)])


def _where_left(found: Diagnosis) -> Iterator[str]:
    """Yield in which run, channel and frequency most is left."""
    sizes = [
        (size, row.run, label(channel))
        for row in left_by_run(found)
        for channel, size in (row.after or row.before).items()
        if np.isfinite(size)
    ]
    if sizes:
        size, run, channel = max(sizes)
        yield f"Most is left of {channel} in {run}: {digits(size)} noise deviations (1 is noise)."
    for trace in worst_traces(found, 1):
        hz = density(trace).peak_hz
        if hz is not None:
            yield f"{label(trace.channel)} of {trace.run} exceeds its noise most at {digits(hz)} Hz"


def _next_steps(found: Diagnosis, next_run: str | None) -> Iterator[str]:
    """Yield what to do now, most urgent first."""
    if next_run is not None:
        yield next_run
    yield _ADVICE[found.answer.kind]
    if found.adequate is False:
        yield _ELSE
    for name in found.answer.causes:
        how = found.layout.causes[name].separated_by
        if how:
            yield f"What shows whether it is {_spoken(name)}: {how}."
    if found.extended is not None:
        yield f"The extended model: {found.extended.source}"


def _recording(found: Diagnosis, moving: bytes | None) -> Markup:
    """Return the run that the base misses most in the viewer, and what opens it there."""
    if not isinstance(found.rig, HopperRig):
        return Markup()
    extended = found.extended
    named = "" if extended is None else f" --model {extended.source}"
    who = "robot and twin" if extended is None else "robot, twin and extended twin"
    caption = f"{found.worst_held_out}, the run held out that the base misses most: {who}."
    return picture(moving, caption) + code(f"workbench review {found.worst_held_out}{named}")


def _provenance(found: Diagnosis, files: Mapping[str, Path], versions: Mapping[str, str]) -> Markup:
    every = {"model": found.rig.source, **files}
    if found.extended is not None:
        every["extended model"] = found.extended.source
    rows = [(what, f"{path}, sha256 {sha256(path)}") for what, path in every.items()]
    rows.append(("seed", str(found.seed)))
    rows.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return table(rows, css="facts")


def _list(texts: Iterable[str]) -> Markup:
    items = Markup().join(Markup("<li>{}</li>").format(text) for text in texts)
    return Markup("<ul>{}</ul>").format(items) if items else items


def _drawn(drawing: Figure, name: str, caption: str) -> Markup:
    return figure(as_svg(drawing, name), caption)


def _spoken(text: str) -> str:
    """Return text with the names of causes as words."""
    return text.replace("_", " ")


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
