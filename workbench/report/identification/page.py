"""The reports of this room: what runs say about resonances, and what a fit found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from markupsafe import Markup

from workbench.fit import MeasuredRun
from workbench.identify import (
    Identification,
    ModeDamping,
    Pair,
    ParameterEstimate,
    Resonances,
    Spectrum,
    fitted_pairs,
    frequency_surface,
)
from workbench.report.drawing import as_svg
from workbench.report.identification.figures import (
    damping_figure,
    figure_4_1,
    figure_4_2,
    figure_4_3,
    figure_4_4,
    figure_4_5,
    sweep_figure,
)
from workbench.report.page import figure, table, warning_list, write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ReportPart", "write_identification", "write_resonances"]

_SHARE = 0.2  # of both stiffnesses, either way, that figure 4.3 shows
_GRID = 9
_MOST_ROWS = 4
_MOST_SPECTRA = 2  # one at each resonance, as in the thesis
_NAMES = {
    "hinge_stiffness": "k, stiffness of a hinge",
    "root_stiffness": "kT, stiffness of the root",
    "hinge_damping": "d, damping of a hinge",
    "root_damping": "dT, damping of the root",
}
_Item = TypeVar("_Item", Pair, MeasuredRun)
_KIND = {True: "viscous", False: "not viscous", None: "not determined"}


class ReportPart(NamedTuple):
    """A part of the report that another module writes: validation, ground contact.

    Args:
        heads: of its table.
        rows: of its table, as text with units.
        text: what it means, in whole sentences.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: str = ""


def write_resonances(
    path: Path,
    title: str,
    runs: Sequence[MeasuredRun],
    found: Resonances,
    modes: Sequence[ModeDamping] = (),
) -> None:
    """Write what runs say about resonances and damping as one HTML page.

    Args:
        path: the `.html` file; one that is there is replaced.
        title: headline.
        runs: that were looked at.
        found: in them.
        modes: damping of the ring-downs among them.
    """
    sections = [
        ("Warnings", warning_list(found.warnings)),
        *_resonance_sections(found, runs),
        ("Damping", _damping(modes)),
        ("Runs", _lines((f"{run.mode}, {run.role}", run.name) for run in runs)),
    ]
    write_page(path, title, f"{len(runs)} runs", _resonance_verdict(found, modes), sections)


def write_identification(
    path: Path,
    identification: Identification,
    resonances: Resonances | None = None,
    damping: Sequence[ModeDamping] = (),
    validation: ReportPart | None = None,
    *,
    hop: Pair | None = None,
    provenance: Mapping[str, str] | None = None,
) -> None:
    """Write what a fit found as one HTML page, with the figures of chapter 4.

    Args:
        path: the `.html` file; one that is there is replaced.
        identification: the fit.
        resonances: of the same runs.
        damping: of the ring-downs among them.
        validation: on runs that were not fitted.
        hop: a hopping run and its simulation, for figure 4.5.
        provenance: rows of what the fit was made from: bundles, hashes, versions.
    """
    sections = [
        ("Warnings", warning_list(identification.warnings)),
        ("Parameters", _parameters(identification)),
        ("Not determined", warning_list(identification.not_determined)),
        ("Validation", _validation(validation)),
        ("Misfit of each run", _misfits(identification)),
        ("Measured and simulated", _pairs(identification)),
        ("Hopping", _hop(hop)),
        ("Longitudinal frequency and stiffness", _surface(identification, resonances)),
        *([] if resonances is None else _resonance_sections(resonances, identification.runs)),
        ("Damping", _damping(damping)),
        ("Made from", _lines((provenance or {}).items())),
    ]
    runs = f"{len(identification.runs)} runs, beam of {identification.robot.increments} increments"
    write_page(path, "Identification of the robot", runs, _verdict(identification), sections)


def _verdict(found: Identification) -> str:
    text = f"{len(found.estimates)} parameters are determined by {len(found.runs)} runs"
    if found.not_determined:
        text += f", {len(found.not_determined)} combinations are not"
    return f"{text}; the fitted model misses the runs by {found.misfit:.2f} times the noise."


def _parameters(found: Identification) -> Markup:
    others = found.within_tolerance
    words = Markup("<p>The model's other numbers, which moved within their tolerances:</p>")
    return _estimates(found.estimates) + (words + _estimates(others) if others else Markup())


def _estimates(estimates: Mapping[str, ParameterEstimate]) -> Markup:
    heads = ("Parameter", "Value", "90 % interval", "Stated", "Change", "Unit")
    rows = [
        (_NAMES.get(name, name.replace("_", " ")), *_within(e.value, e.low, e.high),
         f"{e.stated:.4g}", f"{100 * (e.value / e.stated - 1):+.1f} %", e.unit)
        for name, e in estimates.items()
    ]  # fmt: skip
    return table(rows, heads) if rows else Markup()


def _within(value: float, low: float, high: float) -> tuple[str, str]:
    """Return a value and its interval with the digits that the interval leaves sure."""
    wide = high - low
    if not (np.isfinite(wide) and wide > 0):
        return f"{value:.4g}", f"{low:.4g} to {high:.4g}"
    sure = wide / 4, abs(value) / 10 or wide / 4  # two digits of the value at least
    digits = max(0, *(-int(np.floor(np.log10(size))) for size in sure))
    return f"{value:.{digits}f}", f"{low:.{digits}f} to {high:.{digits}f}"


def _misfits(found: Identification) -> Markup:
    rows = [(name, f"{misfit:.2f}") for name, misfit in _largest_first(found.misfits)]
    noise = ", ".join(f"{size:.2g} at the {group}" for group, size in found.process_noise.items())
    words = Markup(
        "<p>Root mean square of what was seen less what was predicted one sample ahead, in "
        "standard deviations of the cameras' noise; 1 is as good as can be. Process noise, what "
        "the model misses in N m sqrt(s) and N sqrt(s): {}.</p>"
    ).format(noise)
    return words + table(rows, ("Run", "Misfit in sigma"))


def _largest_first(misfits: Mapping[str, float]) -> list[tuple[str, float]]:
    return sorted(misfits.items(), key=lambda pair: -pair[1])


def _pairs(found: Identification) -> Markup:
    pairs = fitted_pairs(found.fit, found.runs)
    clamped = [p for p, run in zip(pairs, found.runs, strict=True) if run.mode == "clamped"]
    chosen = _thinned(clamped or pairs)
    return _drawn(
        figure_4_4(chosen),
        "figure-4-4",
        "Height of T over time, measured and as the fitted model has it (thesis, figure 4.4).",
    )


def _hop(hop: Pair | None) -> Markup:
    if hop is None:
        return Markup()
    caption = "Path of the foot, the robot above, the fitted model below (thesis, figure 4.5)."
    return _drawn(figure_4_5(hop), "figure-4-5", caption)


def _surface(found: Identification, resonances: Resonances | None) -> Markup:
    needed = [found.estimates.get(name) for name in ("hinge_stiffness", "root_stiffness")]
    if None in needed:
        return Markup()
    grids = [
        np.linspace((1 - _SHARE) * e.value, (1 + _SHARE) * e.value, _GRID)
        for e in needed
        if e is not None
    ]
    angle = next((run.start_angle for run in found.runs if run.mode == "decay"), None)
    surface = frequency_surface(found.robot, grids[0].tolist(), grids[1].tolist(), angle)
    return _drawn(
        figure_4_3(surface, found.estimates, _longitudinal(resonances)),
        "figure-4-3",
        "Longitudinal frequency of small swings over both stiffnesses (thesis, figure 4.3), the "
        "rotor where it was in the ring-downs. Measured: the ring-down with the smallest swings.",
    )


def _longitudinal(found: Resonances | None) -> tuple[float, float] | None:
    """Return the longitudinal frequency and its error of the ring-down with the smallest swing."""
    if found is None:
        return None
    lines = [
        line
        for one in found.spectra
        if one.speed == 0
        for line in one.lines
        if line.name == "longitudinal"
    ]
    if not lines:
        return None
    line = min(lines, key=lambda one: max(one.amplitude))
    return line.hz, line.hz_error


def _resonance_sections(found: Resonances, runs: Sequence[MeasuredRun]) -> list[tuple[str, Markup]]:
    return [
        ("Resonances", _peaks(found)),
        ("Answer over the rotor's speed", _sweep(found)),
        ("Oscillation of T", _paths(found, runs)),
        ("Spectra", _spectra(found)),
    ]


def _resonance_verdict(found: Resonances, modes: Sequence[ModeDamping]) -> str:
    named = {peak.oscillation: peak for peak in sorted(found.peaks, key=lambda p: -p.speed_error)}
    rows = [
        f"{name} at {peak.speed:.2f} \N{PLUS-MINUS SIGN} {peak.speed_error:.2f} rad/s"
        for name, peak in named.items()
    ]
    rows = [f"Driven, the robot resonates {', '.join(rows)}"] if rows else []
    if modes:
        rings = " and ".join(f"{mode.hz:.3f} Hz ({mode.oscillation})" for mode in modes)
        rows.append(
            f"let go, it rings at {rings}" if rows else f"Let go, the robot rings at {rings}"
        )
    if found.points:
        rows.append(f"jumps and doubled periods seen: {len(found.jumps) or 'none'}")
    return "; ".join(rows) + "." if rows else "No resonance is seen in these runs."


def _peaks(found: Resonances) -> Markup:
    heads = ("Resonance", "Sweep", "Speed", "Frequency", "T: x, z", "By")
    rows = [
        (peak.oscillation, peak.direction,
         f"{peak.speed:.2f} \N{PLUS-MINUS SIGN} {peak.speed_error:.2f} rad/s", f"{peak.hz:.3f} Hz",
         f"{1000 * peak.amplitude[0]:.1f}, {1000 * peak.amplitude[1]:.1f} mm",
         "oscillator" if peak.fitted else "highest point")
        for peak in found.peaks
    ]  # fmt: skip
    jumps = warning_list(str(jump) for jump in found.jumps)
    return (table(rows, heads) if rows else Markup()) + jumps


def _sweep(found: Resonances) -> Markup:
    if not found.points:
        return Markup()
    caption = (
        "Amplitude of T at the rotor's speed, and by how much it lags behind the rotor's pull. "
        "The robot's free vibration is taken off. Hollow marks still changed."
    )
    return _drawn(sweep_figure(found), "sweep", caption)


def _paths(found: Resonances, runs: Sequence[MeasuredRun]) -> Markup:
    used = {point.run: point.speed for point in found.points}
    clamped = [run for run in runs if run.name in used]
    if not clamped:
        return Markup()
    clamped.sort(key=lambda run: used[run.name])
    caption = "Path of T and its height over time (thesis, figure 4.1)."
    return _drawn(figure_4_1(_thinned(clamped)), "figure-4-1", caption)


def _spectra(found: Resonances) -> Markup:
    if not found.spectra:
        return Markup()
    strongest = sorted(found.spectra, key=lambda s: -float(s.amplitude.max()))
    speeds: dict[str, Spectrum] = {}
    for one in strongest:
        speeds.setdefault(f"{one.speed:.1f}", one)
    free = [one for one in speeds.values() if one.speed == 0]
    driven = [one for one in speeds.values() if one.speed][:_MOST_SPECTRA]
    caption = "Spectra of T's motion where it swings most (thesis, figure 4.2)."
    return _drawn(figure_4_2([*driven, *free]), "figure-4-2", caption)


def _damping(modes: Sequence[ModeDamping]) -> Markup:
    if not modes:
        return Markup()
    heads = ("Mode", "Frequency", "Damping ratio", "90 % interval", "Amplitudes", "Kind")
    rows = [
        (mode.oscillation, f"{mode.hz:.3f} Hz", f"{100 * mode.ratio:.3f} %",
         f"{100 * mode.interval90[0]:.3f} to {100 * mode.interval90[1]:.3f} %",
         f"{1000 * mode.amplitudes[0]:.1f} to {1000 * mode.amplitudes[1]:.1f} mm",
         _KIND[mode.viscous])
        for mode in modes
    ]  # fmt: skip
    caption = (
        "Each point is one window of a ring-down, its bar one standard error; the line is the "
        "mean, the band its 90 % interval."
    )
    return table(rows, heads) + _drawn(damping_figure(modes), "damping", caption)


def _validation(part: ReportPart | None) -> Markup:
    if part is None:
        return Markup("<p>No run was held out, so nothing was validated.</p>")
    return _part(part)


def _part(part: ReportPart | None) -> Markup:
    if part is None:
        return Markup()
    text = Markup("<p>{}</p>").format(part.text) if part.text else Markup()
    return text + table(part.rows, part.heads)


def _lines(rows: Iterable[Sequence[str]]) -> Markup:
    kept = list(rows)
    return table(kept, css="facts") if kept else Markup()


def _thinned(all_of: Sequence[_Item]) -> list[_Item]:
    """Return at most four, spread evenly over the order given."""
    picked = np.linspace(0, len(all_of) - 1, min(_MOST_ROWS, len(all_of))).round().astype(int)
    return [all_of[k] for k in picked]


def _drawn(drawing: Figure, name: str, caption: str) -> Markup:
    return figure(as_svg(drawing, name), caption)
