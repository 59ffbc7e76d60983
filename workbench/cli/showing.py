"""What several verbs show: the answer of a diagnosis, what to run next, a picture for a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from workbench.cli.output import people, show_table, tell
from workbench.comparison_set import ComparisonSet
from workbench.diagnose import Diagnosis, Following
from workbench.errors import WorkbenchError

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["picture_of", "show_diagnosis", "show_next"]


def picture_of(shown: ComparisonSet) -> Image | None:
    """Return a picture for a page, None where this computer cannot take one."""
    tell("picture of the viewer")
    try:
        return shown.picture()
    except WorkbenchError as error:
        people.print(f"the page has no picture of the viewer: {error}", markup=False)
        return None


def show_next(found: Diagnosis, proposed: Following | None) -> None:
    """Print what to run next; where a set stays and no run parts it, what else would."""
    if proposed is not None:
        people.print(
            f"next: {proposed.sentence}\n      workbench run {proposed.protocol.path}", markup=False
        )
    elif found.kind == "SET":
        people.print("no run that can be made here distinguishes these; what would:", markup=False)
        for cause in found.causes:
            people.print(f"  {cause.name}: {cause.separated_by or 'nothing known'}", markup=False)


def show_diagnosis(found: Diagnosis) -> None:
    """Print the answer, its proof, what the refit changed and what was not taken."""
    people.print(f"{found.kind}: {found.reason}", markup=False)
    for cause in found.causes:
        people.print(f"  {cause.name}: {cause.sentence}", markup=False)
    base, after = found.errors, found.extended_errors
    if base is not None and after is not None:
        people.print(f"held out: {', '.join(found.held_out)}", markup=False)
        rows = [
            ["noise floor", f"{base.noise_floor:.3g}"],
            ["base", f"{base.rmse:.3g}"],
            ["extended", f"{after.rmse:.3g}"],
        ]
        show_table("error on runs held out", ["model", f"rmse [{base.unit}]"], rows)
    if found.removed is not None and found.causes:
        people.print(
            f"the extension removes {100 * found.removed:.0f} % of the removable error",
            markup=False,
        )
    if found.extended is not None:
        kind = "extended" if found.causes else "refitted"
        people.print(f"{kind} model: {found.extended.source}", markup=False)
    show_table(
        "what the refit changed",
        ["number", "nominal", "now", "of its tolerance"],
        [[one.name.replace("_", " "), f"{one.stated:.4g}", f"{one.now:.4g} {one.unit}",
          f"{one.share:+.2f}"] for one in found.refit],
    )  # fmt: skip
    if found.alternatives:
        show_table("not taken", ["cause", "why"], [[r.name, r.why_not] for r in found.alternatives])
