"""Write docs/reference/effects.md from the library of effects.

python docs/make_effects.py docs/reference/effects.md
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path

from workbench.sim import EFFECTS, Effect, Quantity

COLUMNS = (
    "effect",
    "what it is",
    "quantities: bounds; tolerance",
    "shows in",
    "confused with",
    "distinguished by",
)
HEAD = """# Effects

An effect is one named cause by which a robot differs from its model. In a model file, `effects` is
a list of such names with their quantities; one that is not given is zero, and zero is absence. A
name means the same for a virtual bench, a simulation and a diagnosis.

<!-- part of: model -->
```yaml
effects:
  - name: hinge_cubic_stiffness
    parameters: {k3: 30.0}   # N m/rad^3
```

The order in the file does not matter: they act in the order of this page. A quantity out of its
bounds is refused. Its tolerance is how large it may well be in a lab that took care.
"""


def main() -> None:
    """Write the page to the file that is named."""
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page."""
    groups = dict.fromkeys(effect.group for effect in EFFECTS.values())
    return "\n".join([HEAD, *map(_section, groups)])


def _section(group: str) -> str:
    effects = [effect for effect in EFFECTS.values() if effect.group == group]
    rows = [_line(COLUMNS), "|" + "---|" * len(COLUMNS), *map(_row, effects)]
    return f"## {group.capitalize()}\n\n" + "\n".join(rows) + "\n"


def _row(effect: Effect) -> str:
    cells = (
        f"`{effect.name}`",
        _told(effect.sentence),
        "<br>".join(map(_quantity, effect.quantities)),
        ", ".join(effect.excited_by),
        ", ".join(f"`{name}`" for name in effect.confused_with),
        effect.separated_by,
    )
    return _line(cells)


def _told(sentence: str) -> str:
    """Return a sentence with the names of its quantities, and both words that a sign asks for."""
    sentence = re.sub(r"{\w+:([^|}]+)\|([^}]+)}", r"\1 (\2)", sentence)
    return re.sub(r"{(\w+)(:size)?}", r"`\1`", sentence)


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _quantity(quantity: Quantity) -> str:
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    bounds = f"{quantity.low:g} to {quantity.high:g}{unit}"
    return f"`{quantity.name}`: {bounds}; {quantity.tolerance:g}{unit}"


if __name__ == "__main__":
    main()
