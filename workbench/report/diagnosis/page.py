"""The page of a diagnosis: what is wrong, how surely, what is still missing, and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from markupsafe import Markup

from workbench.bundle import sha256
from workbench.diagnose import ABSENT, Diagnosis, Kind, Part, Rules, digits, missing_force
from workbench.report.diagnosis.figures import (
    Bar,
    coordinate_figure,
    force_figure,
    gain_figure,
    residual_figure,
)
from workbench.report.diagnosis.tables import causes, drive, errors, refit
from workbench.report.drawing import as_svg
from workbench.report.page import code, figure, folded, picture, table, warning_list, write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["write_diagnosis"]

_HARM = 0.02  # of an error: thousands of samples do not err by so much more by chance
_DOUBTFUL = 2.0  # times the noise: a run held out that errs more is not understood
_HEADLINES: dict[Kind, str] = {
    "NAMED": "Found: {causes}",
    "SET": "Possible: {causes}",
    "PARTIAL": "Found, but not all of it: {causes}",
    "NONE": "No known cause explains the misfit",
    "CLEAN": "The model fits to the noise",
    "DATA_FAULT": "The data are at fault: {causes}",
}
_MORE = (
    "Use the refitted model: it is as good as these runs can show. The runs proposed above would "
    "show causes that these could not."
)
_ADVICE: dict[Kind, str] = {
    "NAMED": "Look for the cause at the machine. Where it is to stay, go on with the extended "
    "model; where it is mended, measure again.",
    "SET": "Do not mend anything yet: these runs cannot decide. Measure runs that differ more.",
    "PARTIAL": "Something else is wrong as well. Mend what was found, measure again, and look at "
    "the machine where the missing force is greatest.",
    "NONE": "Look at the machine where and when the missing force is greatest, change one thing at "
    "a time, measure again.",
    "CLEAN": "Use the refitted model: it is as good as these runs can show. Only runs of other "
    "modes, or with larger motion, would ask more of it.",
    "DATA_FAULT": "Put the measurement right and measure again before anything of the machine is "
    "changed.",
}


def write_diagnosis(
    path: Path,
    found: Diagnosis,
    files: Mapping[str, Path],
    versions: Mapping[str, str],
    next_run: str | None = None,
    moving: bytes | None = None,
    folders: Mapping[str, Path] = MappingProxyType({}),
) -> Path:
    """Write a diagnosis as one HTML page and return its path; the same one gives the same bytes.

    Args:
        path: the `.html` file; one that is there is replaced.
        found: the diagnosis.
        files: what it was made from, by what each is to it.
        versions: of what it was made with, by name.
        next_run: in a sentence, what to measure next; None where nothing was proposed.
        moving: JPEG of the viewer with the run held out that the base misses most and its twins;
            None without one.
        folders: run -> its bundle, for the command that shows it.
    """
    fitted = len(found.observer.base.blocks)
    about = f"{found.kind}: {found.rig.name}, {fitted} runs fitted, {len(found.held_out)} held out"
    sections = [
        ("Warnings", warning_list(_warnings(found))),
        ("Error on the runs held out", _residuals(found) + errors(found)),
        ("Base and extended model in motion", _recording(found, moving, folders)),
        ("Size of the causes" if len(found.causes) > 1 else "Size of the cause", causes(found)),
        ("The missing force", _missing(found)),
        ("Gain of each candidate", _gains(found)),
        ("Alternatives, and why they are out", _alternatives(found)),
        ("What the refit changed", refit(found)),
        ("The drive", drive(found)),
        ("What to do next", _list(_next_steps(found, next_run))),
        ("Rules", folded("All numbers that can change the answer", _rules(found))),
        ("Made from", folded("Files, hashes and versions", _provenance(found, files, versions))),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_page(path, _headline(found), about, _verdict(found), sections)
    return path


def _headline(found: Diagnosis) -> str:
    *others, last = [_spoken(one.name) for one in found.causes] or [""]
    names = f"{', '.join(others)} {'or' if found.kind == 'SET' else 'and'} " if others else ""
    names += last
    if found.kind == "DATA_FAULT" and found.faults:
        names = ", ".join(run for run, _ in found.faults)
    return _HEADLINES[found.kind].format(causes=names).removesuffix(": ")


def _verdict(found: Diagnosis) -> str:
    """Return the causes in sentences, or the reason for none, and the errors."""
    sure = found.causes and found.kind != "SET"
    sentences = [one.sentence for one in found.causes] if sure else []
    if not sure or found.kind in ("PARTIAL", "DATA_FAULT"):
        sentences.append(_spoken(found.reason))
    if found.confidence is not None:
        sentences.append(found.confidence.sentence)
    base, after = found.errors, found.extended_errors
    if base is not None:
        gain = f"On runs that no fit has seen, the model's error is {digits(base.rmse)} {base.unit}"
        if after is not None:
            gain += f", the extended one's {digits(after.rmse)} {after.unit}"
        sentences.append(f"{gain}; noise alone makes {digits(base.noise_floor)} {base.unit}")
    return " ".join(f"{_sentence(one)}." for one in sentences)


def _warnings(found: Diagnosis) -> Iterator[str]:
    """Yield which runs do not count, and where those held out speak against the answer."""
    for run, evidence in found.faults:
        yield f"{run} is left out: {evidence}"
    base, after = found.errors, found.extended_errors
    if base is None or after is None:
        yield "no run was held out: nothing but the fitted runs speaks for the answer"
        return
    for name, error in after.by_run.items():
        before = base.by_run.get(name, error)
        if error > max((1 + _HARM) * before, base.noise_floor):
            yield (
                f"{name} speaks against the answer: the extension's error is {digits(error)} "
                f"{base.unit} where the base's is {digits(before)} {base.unit}"
            )
        elif error > _DOUBTFUL * base.noise_floor:
            yield (
                f"{name} is not understood: the extension's error is {digits(error)} {base.unit} "
                f"where noise makes {digits(base.noise_floor)} {base.unit}"
            )


def _missing(found: Diagnosis) -> Markup:
    """Return what force the refitted base misses, and what it depends on."""
    missing = missing_force(found.observer.base, found.rules)
    if missing is None:
        return Markup()
    opening = Markup("<p>{}.</p>").format(_sentence(missing.sentence))
    words = "What the refitted base would need at T to do as the robot did, means over 0.05 s."
    if missing.sentence == ABSENT:
        size = f"{digits(missing.power)} times the power that the cameras' noise alone makes of it"
        return opening + Markup("<p>{}</p>").format(f"The smoothed force at T has {size}.")
    best = missing.dependences[0]
    rows = [(one.name, f"{100 * one.share:.0f} %", one.law) for one in missing.dependences]
    return (
        opening
        + _drawn(force_figure(missing), "force", (
            f"{words} The run with the most; the band is twice what noise alone makes. The force "
            "is drawn towards zero by as much as the cameras leave open."
        ))
        + _drawn(coordinate_figure(missing), "coordinate", (
            f"The same force in all fitted runs against what explains most of it, {best.name}."
        ))
        + table(rows, ("Coordinate", "Share explained", "Law"), css="facts")
        + Markup("<p>{}</p>").format(
            "Share of what is missing beyond the noise, each coordinate alone, in pieces of the "
            "runs that the regression has not seen. A law is named where one term explains nearly "
            "as much as all of its coordinate."
        )
    )  # fmt: skip


def _residuals(found: Diagnosis) -> Markup:
    """Return the errors over time in the run held out that the base misses most."""
    base, after = found.errors, found.extended_errors
    if base is None or after is None:
        return Markup()
    run = found.worst_held_out
    words = f"{run}, the run held out that the base misses most. Root mean square over 0.25 s, "
    words += "on a logarithmic scale; grey: noise alone."
    return _drawn(residual_figure(base, after, run), "residual", words)


def _gains(found: Diagnosis) -> Markup:
    """Return what each candidate was estimated to gain, and what it gained when it was fitted."""
    repeats = found.observer.fits.repeats()
    listed = {one.name for one in found.causes}
    estimated = {(one.name,): one.gain / repeats for one in found.observer.promises}
    fitted = {
        names: gain for part in found.parts.values() for names, gain in _fitted(part, found.rules)
    }
    bars = [
        Bar(names, estimated.get(names), fitted.get(names), set(names) <= listed)
        for names in {**estimated, **fitted}
    ]
    if not bars:
        return Markup()
    caption = (
        "Gain in log-likelihood over the refitted base (2 ln of the ratio, fitted runs). Bars and "
        "left numbers: as estimated by one linearisation, before any fit. Diamonds and right "
        "numbers: when it was fitted; several together where they gain more than fewer. Green: "
        "in the answer. Below the threshold it may be chance."
    )
    return _drawn(gain_figure(bars, found.rules.least_gain), "gain", caption)


def _fitted(part: Part, rules: Rules) -> Iterator[tuple[tuple[str, ...], float]]:
    """Yield what hypotheses gained; of two causes together only where that is more than of one."""
    single = {one.names[0]: against.gain for one, against in part.compared if len(one.names) == 1}
    for one, against in part.compared:
        alone = max((single.get(name, 0.0) for name in one.names), default=0.0)
        if (
            len(one.names) == 1
            or one.names == part.best.names
            or against.gain > alone + rules.least_gain
        ):
            yield one.names, against.gain


def _alternatives(found: Diagnosis) -> Markup:
    """Return every cause that was not taken, and why; those that were not fitted as well."""
    reason = Markup("<p>{}.</p>").format(_sentence(_spoken(found.reason)))
    rows = [(_spoken(one.name), _spoken(one.why_not)) for one in found.alternatives]
    listed = {one.name for one in (*found.alternatives, *found.causes)}
    best = found.observer.promises[0].gain if found.observer.promises else 0.0
    repeats, rules = found.observer.fits.repeats(), found.rules
    rows += [
        (_spoken(one.name), f"not fitted: its estimated gain is {digits(one.gain / repeats)}, "
         f"{100 * one.gain / best:.2g} % of the greatest")
        for one in found.observer.promises
        if one.name not in listed and one.gain / repeats > rules.least_gain
    ]  # fmt: skip
    return reason + table(rows, ("Cause", "Why it is out"), css="facts") if rows else reason


def _rules(found: Diagnosis) -> Markup:
    """Return all thresholds, with what each is of."""
    doc = type(found.rules).__doc__ or ""
    what = {
        name.strip(): words.strip()
        for name, _, words in (line.partition(":") for line in doc.splitlines())
        if words
    }
    rows = [
        (one.name, f"{getattr(found.rules, one.name):g}", what.get(one.name, ""))
        for one in fields(found.rules)
    ]
    return table(rows, ("Rule", "Value", "Of what"), css="runs")


def _next_steps(found: Diagnosis, next_run: str | None) -> Iterator[str]:
    """Yield what to do now, most urgent first."""
    if next_run is not None:
        yield next_run
    clean = found.kind == "CLEAN"
    yield _MORE if clean and next_run is not None else _ADVICE[found.kind]
    for cause in found.causes:
        candidate = found.observer.fits.candidates.get(cause.name)
        if candidate is not None and candidate.separated_by:
            yield f"What shows whether it is {_spoken(cause.name)}: {candidate.separated_by}."
    if found.extended is not None:
        which = "extended" if found.causes else "refitted"
        yield f"The {which} model: {found.extended.source}"


def _recording(found: Diagnosis, moving: bytes | None, folders: Mapping[str, Path]) -> Markup:
    """Return the run held out that the base misses most in the viewer, and what opens it there."""
    if found.errors is None or moving is None:
        return Markup()
    worst = found.worst_held_out
    named = "" if found.extended is None else f" --model {found.extended.source}"
    caption = (
        f"{worst}: the robot with its beam as estimated (orange), the base (blue) and the extended "
        "model (green), all started and turned as the diagnosis compared them. The second tab of "
        "the recording has them as commanded."
    )
    shown = picture(moving, caption)
    return shown + code(f"workbench review {folders.get(worst, worst)}{named}")


def _provenance(found: Diagnosis, files: Mapping[str, Path], versions: Mapping[str, str]) -> Markup:
    every = {"model": found.rig.source, **files}
    if found.extended is not None:
        every["extended model"] = found.extended.source
    rows = [
        (what, f"{path}, sha256 {sha256(path)}" if path.is_file() else str(path))
        for what, path in every.items()
    ]
    rows.append(("seconds", digits(found.seconds)))
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
