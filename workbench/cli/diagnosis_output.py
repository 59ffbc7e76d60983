"""The text of a diagnosis and of its next run, for several verbs."""

from __future__ import annotations

from workbench.cli.console import show_table, stderr
from workbench.diagnose import Diagnosis
from workbench.investigate import Following
from workbench.report import finer_beam

__all__ = ["show_diagnosis", "show_next"]


def show_next(found: Diagnosis, proposed: Following | None) -> None:
    """Print what to run next; where no run separates a set of causes, what else would."""
    if proposed is not None:
        stderr.sentence(f"next: {proposed.sentence}", "      ")
        stderr.print(f"      workbench run {proposed.protocol.path}", markup=False)
    elif found.kind == "SET":
        stderr.print("no run that can be made here distinguishes these; what would:", markup=False)
        for cause in found.causes:
            stderr.sentence(f"  {cause.name}: {cause.separated_by or 'nothing known'}", "    ")


def show_diagnosis(found: Diagnosis) -> None:
    """Print the answer, its validation, what the refit changed and which causes were rejected."""
    stderr.sentence(f"{found.kind}: {found.reason}")
    for cause in found.causes:
        stderr.sentence(f"  {cause.name}: {cause.sentence}", "    ")
    if found.confidence is not None:
        stderr.sentence(found.confidence.sentence)
    base, after = found.errors, found.extended_errors
    if base is not None and after is not None:
        stderr.sentence(f"held out: {', '.join(found.held_out)}")
        rows = [
            ["noise floor", f"{base.noise_floor:.3g}"],
            ["base", f"{base.rmse:.3g}"],
            ["extended", f"{after.rmse:.3g}"],
        ]
        show_table("error on runs held out", ["model", f"rmse [{base.unit}]"], rows)
    if found.removed is not None and found.causes:
        stderr.print(
            f"the extension removes {100 * found.removed:.0f} % of the removable error",
            markup=False,
        )
    if found.extended is not None:
        kind = "extended" if found.causes else "refitted"
        stderr.print(f"{kind} model: {found.extended.source}", markup=False)
        beam = finer_beam(found)
        if beam is not None:
            stderr.print(f"  {beam}", markup=False)
    show_table(
        "what the refit changed",
        ["number", "nominal", "now", "of its tolerance"],
        [[one.name.replace("_", " "), f"{one.stated:.4g}",
          f"{one.now:.4g} {one.unit}".removesuffix(" 1"),  # a number without a unit
          f"{one.share:+.2f}"] for one in found.observer.refit],
    )  # fmt: skip
    if found.alternatives:
        show_table("not taken", ["cause", "why"], [[r.name, r.why_not] for r in found.alternatives])
