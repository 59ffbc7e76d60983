"""The tables of a diagnosis' page: errors, sizes of causes, the refit and the drive."""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup

from workbench.diagnose import DRIVE, Amount, Diagnosis, DrivePart, HopperRig, digits, together
from workbench.report.page import table
from workbench.sim import EFFECTS, Quantity

__all__ = ["causes", "drive", "errors", "finer_beam", "refit"]

_ALL = "all of them"
_T90 = 1.645


def errors(found: Diagnosis) -> Markup:
    """Return how far base and extension are from the runs held out, free and some time ahead."""
    base, after = found.errors, found.extended_errors
    if base is None:
        return Markup()
    models = {"Base": base} if after is None else {"Base": base, "Extended": after}
    several = len(base.by_run) > 1
    rows = [(run, *(digits(one.by_run[run]) for one in models.values())) for run in base.by_run]
    if several:
        rows.append((_ALL, *(digits(one.rmse) for one in models.values())))
    for key in base.ahead:
        ahead = (one.ahead.get(key) for one in models.values())
        shown = ("" if value is None else digits(value) for value in ahead)
        rows.append((f"{key} s ahead{', ' + _ALL if several else ''}", *shown))
    for row, run in enumerate(base.by_run):
        rows[row] += (digits(base.noise[run]),)
    noise = digits(base.noise_floor)
    rows[len(base.by_run) :] = [(*row, noise) for row in rows[len(base.by_run) :]]
    heads = ("Run", *(f"{name} [{base.unit}]" for name in models), f"Noise alone [{base.unit}]")
    turned = "as commanded (the cause is the drive's)" if _driven(found) else "as measured"
    words = (
        "Root mean square distance of foot and T (of T where the foot is clamped) from where the "
        "cameras saw them. A run is simulated freely, started as measured, its rotor turned "
        f"{turned}. A hop is compared over its first hops only, for then it is chaotic. Ahead: "
        "predicted from the state that was observed, the rotor turned as measured."
        if base.motions
        else "Root mean square of free simulations from the starts that fit best."
    )
    if found.removed is not None:
        share = f"{100 * found.removed:.0f} %"
        words += f" The extension removes {share} of what exceeds the noise."
    return table(rows, heads) + Markup("<p>{}</p>").format(words)


def _driven(found: Diagnosis) -> bool:
    part = found.parts.get("drive")
    return bool(part and part.best.names)


def causes(found: Diagnosis) -> Markup:
    """Return what was found of each cause, with its interval."""
    rows = [
        (_spoken(cause.name), _spoken(key), *_displayed(amount))
        for cause in found.causes
        for key, amount in cause.quantities.items()
    ]
    if not rows:
        return Markup()
    sizes = table(rows, ("Cause", "Quantity", "Value", "90 % interval", "Unit"))
    several = found.causes if found.kind == "SET" else ()
    return sizes + _list(f"{one.sentence[:1].upper()}{one.sentence[1:]}." for one in several)


def refit(found: Diagnosis) -> Markup:
    """Return the model's own numbers, nominal and as the fit has them, farthest moved first."""
    moved = sorted(found.observer.refit, key=lambda one: -abs(one.share))
    rows = [
        (_spoken(one.name), digits(one.stated), digits(one.now),
         f"{digits(one.low)} to {digits(one.high)}", one.unit, f"{one.share:+.2f}")
        for one in moved
    ]  # fmt: skip
    if not rows:
        return Markup()
    heads = ("Number", "Nominal", "Now", "90 % interval", "Unit", "Of tolerance")
    holder = together([_spoken(name) for name in found.observer.best.names])
    words = (
        f"As the model has them beside {holder}." if holder else "As the refitted base has them."
    ) + " Each number was fitted within its tolerance; 1 is a whole one."
    beam = finer_beam(found)
    if beam is not None:
        words += f" {beam[:1].upper()}{beam[1:]}."
    return table(rows, heads) + Markup("<p>{}</p>").format(words)


def finer_beam(found: Diagnosis) -> str | None:
    """Return that the runs prefer a beam of more increments, in words; None where they do not."""
    rig = found.rig
    if not isinstance(rig, HopperRig) or rig.robot.increments == rig.document.content.increments:
        return None
    stated = rig.document.content.increments
    return (
        f"a beam of {rig.robot.increments} increments follows these runs better than one of "
        f"{stated}; the new model has it"
    )


def drive(found: Diagnosis) -> Markup:
    """Return what the rotor's angle says of the drive; nothing where nothing is driven."""
    if found.drive is None:
        return Markup()
    part, sizes = found.drive.part, _sizes(found.drive)
    gains = {one.names[0]: against for one, against in part.compared if len(one.names) == 1}
    listed = {one.name for one in found.causes}
    rows, how = list[tuple[str, ...]](), "possible" if part.kind == "SET" else "found"
    for name in (one for one in DRIVE if one in gains):
        gain, held = digits(gains[name].gain), digits(gains[name].held)
        title = f"{_spoken(name)} ({how})" if name in listed else _spoken(name)
        for key, amount in sizes.get(name, {"": None}).items():
            shown = ("", "", "") if amount is None else _displayed(amount)
            rows.append((title, _spoken(key), *shown, gain, held))
            title = gain = held = ""
    words = _spoken(f"{part.reason[:1].upper()}{part.reason[1:]}.")
    heads = ("Cause", "Quantity", "Value", "90 % interval", "Unit", "Gain", "Held out")
    below = (
        "Each as if it were alone. Gain: by how much -2 ln of the likelihood of the rotor's angle "
        "falls, in the runs fitted and in those held out."
    )
    paragraph = Markup("<p>{}</p>").format
    return paragraph(words) + (table(rows, heads) + paragraph(below) if rows else Markup())


def _sizes(found: DrivePart) -> dict[str, dict[str, Amount]]:
    """Return of each cause in the drive how large it would be alone."""
    fitted, sizes = found.fitted, dict[str, dict[str, Amount]]()
    for name in DRIVE:
        if name not in fitted.quantities:
            continue
        values = fitted.values((name,), fitted.solved((name,)))
        quantities = EFFECTS[name].quantities
        sizes[name] = {q.name: _within(q, *values[f"{name} {q.name}"]) for q in quantities}
    return sizes


def _within(quantity: Quantity, value: float, error: float) -> Amount:
    """Return a quantity with its 90 % interval, no farther than its bounds."""
    wide, low, high = _T90 * error, quantity.low, quantity.high
    centre, least, most = (min(max(e, low), high) for e in (value, value - wide, value + wide))
    return Amount(centre, least, most, quantity.unit)


def _displayed(amount: Amount) -> tuple[str, str, str]:
    value, low, high, unit = amount.displayed
    return digits(value), f"{digits(low)} to {digits(high)}", unit


def _list(texts: Iterable[str]) -> Markup:
    items = Markup().join(Markup("<li>{}</li>").format(text) for text in texts)
    return Markup("<ul>{}</ul>").format(items) if items else items


def _spoken(text: str) -> str:
    return text.replace("_", " ")
