"""The report of a fit, from what `workbench identify` has at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from workbench.bundle import Bundle, sha256
from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.identify import (
    Identification,
    ModeDamping,
    PointError,
    Resonances,
    RunValidation,
    Validation,
    damping,
    resonances,
    simulated_pair,
)
from workbench.report.identification.page import ReportPart, write_identification
from workbench.schemas import Document, ModelFile
from workbench.sim import Robot

__all__ = ["made_from", "report_fit"]

_DIGEST = 12  # digits of a hash that a reader compares


def report_fit(
    path: Path,
    found: Identification,
    runs: Sequence[MeasuredRun],
    robot: Robot,
    validation: Validation,
    provenance: Mapping[str, str],
) -> Path:
    """Write the report of a fit as one HTML page and return its path.

    Args:
        path: the `.html` file; one that is there is replaced.
        found: the fit.
        runs: fitted and held out; the first hop among them is shown beside its simulation.
        robot: as fitted.
        validation: on the runs that were held out.
        provenance: rows of what the fit was made from.
    """
    used = [run for run in found.runs if run.mode in ("clamped", "decay")]
    hop = next((run for run in runs if run.mode == "hop"), None)
    write_identification(
        path,
        found,
        _resonances(used),
        _damping(used),
        _validated(validation),
        hop=None if hop is None else simulated_pair(hop, robot),
        provenance=provenance,
    )
    return path


def made_from(
    bundles: Sequence[Bundle], stated: Document[ModelFile], written: Document[ModelFile]
) -> dict[str, str]:
    """Return which models and takes a fit was made from, each with its hash, and the versions."""
    rows = {
        "nominal model": f"{stated.content.name} ({sha256(stated.path)[:_DIGEST]})",
        "new model": f"{written.path.name} ({sha256(written.path)[:_DIGEST]})",
    }
    for k, bundle in enumerate(bundles, start=1):
        take = bundle.take()
        rows[f"run {k}, {bundle.asked.role.replace('_', ' ')}"] = (
            f"{bundle.path.name}, {take.name} ({sha256(take)[:_DIGEST]})"
        )
    versions = bundles[0].asked.versions
    return rows | {"versions": ", ".join(f"{name} {version}" for name, version in versions.items())}


def _resonances(runs: Sequence[MeasuredRun]) -> Resonances | None:
    try:
        return resonances(runs)
    except InputError:
        return None  # too short to be looked at; a fit needs less than a spectrum


def _damping(runs: Sequence[MeasuredRun]) -> tuple[ModeDamping, ...]:
    try:
        return damping(runs)
    except InputError:
        return ()


def _validated(validation: Validation) -> ReportPart | None:
    pooled = validation.pooled
    if pooled is None:
        return None
    rows = [_row(run.name, point) for run in validation.runs for point in run.points]
    rows.append(_row("all", pooled))
    text = (
        "Root mean square position error on runs held out, in mm: noise floor, nominal model, "
        "fitted model; last, the reduction of the error above the noise."
    )
    heads = ("Run", "Point", "Noise", "Stated", "Fitted", "Removed")
    sentences = " ".join(sentence for run in validation.runs if (sentence := _predicted(run)))
    return ReportPart(heads, rows, f"{text} {sentences}".strip())


def _row(name: str, point: PointError) -> tuple[str, ...]:
    removed = f"{100 * point.removed:.1f} %" if np.isfinite(point.removed) else "nothing to remove"
    errors = (point.noise_mm, point.stated_mm, point.fitted_mm)
    return (name, point.point, *(f"{error:.3f}" for error in errors), removed)


def _predicted(run: RunValidation) -> str:
    text = "; ".join(
        f"{ahead} s ahead {stated:.3g} mm nominal, {fitted:.3g} mm fitted"
        for ahead, (stated, fitted) in run.predicted.items()
        if stated is not None and fitted is not None
    )
    return f"Predicted from the observed state, {run.name}: {text}." if text else ""
