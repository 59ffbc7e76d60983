"""The report of a search: one page with the design, what it gains, and how it was found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from workbench.bundle import sha256
from workbench.design import GOALS, Appraisal, DesignFiles, DistanceDraws, Problem, Study, appraise
from workbench.errors import InputError
from workbench.optimize import History
from workbench.report.design.experiments import ExperimentTable, Part
from workbench.report.design.figures import path_figure, shape_figure
from workbench.report.design.search_figures import draw_front, draw_generations, draw_variables
from workbench.report.drawing import as_svg, drawn
from workbench.report.page import figure, table, warning_list, write_page

__all__ = ["verdict", "write_experiment", "write_report"]

_ROWS = {
    "distance_m": ("Distance", 1.0, "m", 3),
    "hop_height_m": ("Hop height", 1e3, "mm", 1),
    "weight_times_way_per_work": ("1 / cost of transport", 1.0, "", 2),
    "tipping_margin_rad": ("Margin to tipping over", 180 / np.pi, "deg", 1),
    "L0_m": ("L0, root to T, free strip", 1e2, "cm", 2),
    "dh_m": ("dh, depth of the bow", 1e2, "cm", 2),
    "e": ("e = dh / L0", 1.0, "", 2),
    "standing_L0_m": ("L0 of the standing robot", 1e2, "cm", 2),
    "standing_dh_m": ("dh of the standing robot", 1e2, "cm", 2),
    "standing_e": ("e of the standing robot", 1.0, "", 2),
    "tightest_radius_m": ("Tightest radius", 1e3, "mm", 0),
    "zeta_T_hz": ("Torsional frequency, clamped", 1.0, "Hz", 2),
    "zeta_L_hz": ("Longitudinal frequency, clamped", 1.0, "Hz", 2),
}
"""Number -> name, factor, unit, digits."""
_MOST_REASONS = 8
_MOST_FRONT = 12


def write_report(
    path: Path,
    study: Study,
    history: History,
    found: Sequence[DesignFiles],
    spread: DistanceDraws,
    versions: Mapping[str, str],
) -> None:
    """Write the page; designs hop once more for it, as the model's robot.

    Args:
        path: the `.html` file; one that is there is replaced.
        study: that searched.
        history: of it.
        found: the designs, best first.
        spread: distances of the best one over start angle, friction and speed.
        versions: of what it was made with, by name.
    """
    problem = study.problem
    best = appraise(problem, found[0].trial.candidate)
    try:
        first = appraise(problem, problem.space.start)
    except InputError:  # a search may begin at a shape that does not stand
        first = None
    sections = [
        ("Warnings", warning_list(_warnings(study, history, first))),
        ("Result", _numbers(first, best) + _spread(spread)),
        ("Front", _front(study, history, found)),
        ("Path", _paths(first, best)),
        ("Search", _progress(study, history)),
        ("Shape", _shapes(problem, first, best)),
        ("Angles", _angles(study, history, found[0])),
        ("What failed", _failures(history)),
        ("Go on", _next(study, found[0])),
        ("Made from", _provenance(study, history, versions)),
    ]
    title = f"A beam for {found[0].omega:g} rad/s"
    about = f"{study.settings.algorithm}, {history.asked} evaluations: {problem.words}"
    write_page(path, title, about, verdict(found[0], first), sections)


def write_experiment(path: Path, name: str, about: str, parts: Iterable[Part]) -> None:
    """Write the page of an experiment of the thesis.

    Args:
        path: the `.html` file; one that is there is replaced.
        name: of the experiment.
        about: what was searched how.
        parts: its tables and figures.
    """
    sections = [
        (part.title, table(part.rows, part.heads) + Markup("<p>Thesis: {}</p>").format(part.note))
        if isinstance(part, ExperimentTable)
        else (part.title, figure(as_svg(part.figure, part.name), part.caption))
        for part in parts
    ]
    write_page(path, f"The thesis' experiment: {name}", about, "Ours beside the thesis.", sections)


def verdict(found: DesignFiles, first: Appraisal | None) -> str:
    """Return the result in a sentence."""
    text = f"The best design goes {_way(found.values['distance_m'])}"
    if first is None or "distance" not in first.values:
        return f"{text}; the first shape does not hop."
    return f"{text}; the first shape goes {_way(first.values['distance'])}."


def _way(metres: float) -> str:
    """Return a distance with three digits that count."""
    return f"{metres:.2f} m" if abs(metres) >= 1 else f"{1000 * metres:.0f} mm"


def _warnings(study: Study, history: History, first: Appraisal | None) -> list[str]:
    texts = []
    if history.asked < study.settings.evaluations - max(len(g.trials) for g in history.generations):
        texts.append(
            f"stopped after {history.asked} of {study.settings.evaluations} evaluations; "
            f"workbench optimize --resume {study.folder} goes on"
        )
    if first is None:
        texts.append(f"the first shape, {study.start.content.name}, does not stand")
    return texts


def _numbers(first: Appraisal | None, best: Appraisal) -> Markup:
    columns = [_values(one) for one in (first, best)]
    rows = [
        (name, *(_with_unit(values.get(key), factor, unit, digits) for values in columns))
        for key, (name, factor, unit, digits) in _ROWS.items()
    ]
    return table(rows, ("", "First shape", "Best design"))


def _spread(spread: DistanceDraws) -> Markup:
    return Markup(
        "<p>Over all start angles, with friction and speed as uncertain as they are, the best "
        "design goes {}.</p>"
    ).format(spread.text())


def _values(one: Appraisal | None) -> dict[str, float]:
    if one is None:
        return {}
    return {GOALS[name].column: value for name, value in one.values.items()} | one.numbers


def _with_unit(value: float | None, factor: float, unit: str, digits: int) -> str:
    return "-" if value is None else f"{factor * value:.{digits}f} {unit}".rstrip()


def _front(study: Study, history: History, found: Sequence[DesignFiles]) -> Markup:
    if len(study.settings.goals) == 1:
        return Markup()
    first, second = (goal.column for goal in study.problem.goals)
    picture = as_svg(drawn(lambda f: draw_front(f, history, (first, second)), 3.6), "front")
    heads = ("", first, second)
    rows = [
        (one.name, *(f"{one.values[goal.column]:.3g}" for goal in study.problem.goals))
        for one in found[:: max(1, -(-len(found) // _MOST_FRONT))]
    ]
    return figure(picture, "Every candidate by both goals.") + table(rows, heads)


def _paths(first: Appraisal | None, best: Appraisal) -> Markup:
    motions = {} if first is None else {"first shape": first.motion}
    picture = as_svg(path_figure(motions | {"best design": best.motion}), "path")
    return figure(picture, "Path of the foot's centre, as in figure 6.1. The height is stretched.")


def _progress(study: Study, history: History) -> Markup:
    column = study.problem.goals[0].column
    picture = drawn(lambda f: draw_generations(f, {"search": history}, column), 4.6)
    picture = as_svg(picture, "progress")
    words = "Best so far, and best and mean of each generation (figure 6.2 of the thesis)."
    return figure(picture, words)


def _shapes(problem: Problem, first: Appraisal | None, best: Appraisal) -> Markup:
    root = np.array([problem.model.values()["beam_root"], 0.0])
    curves = {} if first is None else {"first shape": [first.standing, first.free + root]}
    curves["best design"] = [best.standing, best.free + root]
    picture = as_svg(shape_figure(curves, problem.model.values()["foot_length"]), "shape")
    return figure(picture, "The beam of the standing robot; thin, as the free strip was bent.")


def _angles(study: Study, history: History, found: DesignFiles) -> Markup:
    space = study.problem.space
    rows = [
        (name, f"{start:.3f}", f"{value:.3f}", f"{low:g} to {high:g}")
        for name, start, value, low, high in zip(
            space.names, space.start, found.trial.candidate, space.lower, space.upper, strict=True
        )
    ]
    picture = drawn(lambda f: draw_variables(f, space, {"best": history}), 3.4)
    return figure(as_svg(picture, "variables"), "The best candidate between its bounds.") + table(
        rows, ("[rad], or SI", "First", "Best", "Bounds")
    )


def _failures(history: History) -> Markup:
    texts = Counter(_kind(text) for g in history.generations for text in g.failures)
    rows = [(text, str(count)) for text, count in texts.most_common(_MOST_REASONS)]
    return table(rows, ("Why", "Candidates")) if rows else Markup()


def _kind(text: str) -> str:
    """Return a failure without its numbers: the sentence up to the first detail."""
    return text.split(":")[0] if text.startswith("this") else text.split(" after ")[0]


def _next(study: Study, found: DesignFiles) -> Markup:
    model = found.model or study.model.path
    hop = (
        f"workbench simulate --shape {found.shape} --model {model} --omega {found.omega:g} "
        f"--duration {study.settings.duration:g}"
    )
    steps = {
        "Hop it again:": hop,
        "Print it at 1:1, bend the strip over it, photograph it and read it back:": (
            f"workbench template {found.shape}"
        ),
        "Search on from here:": (
            f"workbench optimize --resume {study.folder} "
            f"--evaluations {2 * study.settings.evaluations}"
        ),
    }
    parts = (Markup("<p>{}</p><pre>{}</pre>").format(*step) for step in steps.items())
    return Markup().join(parts)


def _provenance(study: Study, history: History, versions: Mapping[str, str]) -> Markup:
    rows = [
        *((name, str(value)) for name, value in vars(study.settings).items()),
        *((n, f"{p.name}, {sha256(p)[:12]}") for n, p in _files(study).items() if p.exists()),
        *versions.items(),
        ("evaluations", f"{history.asked} asked for, {history.evaluated} simulated"),
        ("wall time", f"{history.seconds:.0f} s"),
    ]
    return table([(name, text) for name, text in rows], css="facts")


def _files(study: Study) -> dict[str, Path]:
    return {"model": study.model.path, "shape": study.start.path, "search": study.checkpoint}
