"""Write docs/reference/supplies.md from the model table.

python docs/make_supplies.py docs/reference/supplies.md
"""

from __future__ import annotations

import sys
from pathlib import Path

from workbench.hw import (
    FAMILIES,
    MODELS,
    Family,
    ModbusModel,
    Model,
    Rating,
    ScpiModel,
    SimulatedFault,
)

HEAD = """# Supplies

One row a model; `workbench supply models --json` prints the same. A supply that answers as none of
these is refused: its scales would be a guess. Only the registers and commands that set voltage,
current limit, trip levels and the output are ever sent; calibration, boot loader, recalls and
resets are held back at the link.

`on a lost link` says what the supply itself does when computer and cable are gone. Where that is
nothing, the guardian switches off when the program dies; when the computer dies nobody does: keep
its trip levels low and a switch within reach.

`channel: 2` beside the connection in a bench file drives the second output of a supply that has
several; without it channel 1 is driven.

The tables were compiled from published drivers and manuals, in the column `source`. No real supply
has been connected yet.
"""

LANGUAGES: dict[Family, str] = {
    "riden": "Riden RD60xx: Modbus RTU on a serial port, RTU over TCP, Modbus TCP through a bridge",
    "dps": "RuiDeng DPS and DPH: Modbus RTU on a serial port, RTU over TCP",
    "hanmatek": "Hanmatek HM30x and its twins by eTommens and RockSeed: Modbus RTU",
    "korad": "Korad, Tenma, RND, Velleman, Stamos: text without terminator, serial or a raw socket",
    "scpi": "SCPI in its makers' dialects: text, serial or a raw socket",
}

TRUTH = """
## What is believed

- A Modbus answer counts when unit, function, length and checksum fit, and a write when its echo and
  then the register itself say so. Successive reads of a block differ in length; after any doubt a
  block of a length of its own has to be answered before anything else is asked.
- Text has no numbers and no checksum. Each question names the form of its answer; the questions of
  a reading are ordered so that no two neighbours' answers look alike, the state is asked for twice,
  and bytes in between that nobody asked for refuse the whole reading. What no software can notice
  is a digit that turns into another digit on the wire.
- Of a supply with several channels every command and every question names its channel, or selects
  it in the same message: what somebody selects at the front or over a second link changes nothing.
- The output's flag counts when the supply that is known by model and serial number answers behind
  it, and nothing came in between that nobody asked for.
- A model is known by an id that a manual or a maintained client names, one by one. A supply that
  answers with another one is refused, as one that never answers `*IDN?` is (a 72-13360 does not).
- A setpoint is read back and has to be the value that was asked for, rounded to the nearest step.
- `benchmarks/wire.py` counts what comes of it: 100,000 disturbed exchanges a family, with stubs
  that share no table with the drivers, and not one wrong reading or false off accepted.
"""

FAULTS = """## Simulated supplies and their faults

`workbench supply simulate FAMILY --model M` serves a device that answers the real bytes, on Modbus
TCP or a raw socket (`--tcp`), as RTU frames over TCP (`--rtu-over-tcp`) or on a pseudo terminal
(`--pty`). `--fault NAME:SECONDS` and lines on its standard input switch faults; `mend` ends one,
`state` shows what is at the terminals, `end` ends the device. The faults: {faults}.
"""


def main() -> None:
    """Write the page."""
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page as Markdown."""
    parts = [HEAD]
    for family in FAMILIES:
        rows = [model for model in MODELS if model.family == family]
        parts += [f"\n## {family}\n\n{LANGUAGES[family]}.\n", *_table(rows), *_quirks(rows)]
    parts += [TRUTH, *_faults()]
    return "\n".join(part.rstrip("\n") if part.startswith("|") else part for part in parts)


def _table(rows: list[Model]) -> list[str]:
    identity = "model ids" if isinstance(rows[0], ModbusModel) else "answer to `*IDN?`"
    head = ["model", identity, "up to", "steps", "baud", "on a lost link", "source"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for model in rows:
        name = model.name + "".join(f", {other}" for other in model.also)
        known = model.identity if isinstance(model, ModbusModel) else f"`{_cell(model.identity)}`"
        steps = f"{model.voltage_step_V} V, {', '.join(map(str, model.current_steps_A))} A"
        cells = [name, known, _up_to(model), steps]
        lines.append(
            "| " + " | ".join([*cells, str(model.baud), model.on_lost_link, model.source]) + " |"
        )
    return lines


def _up_to(model: Model) -> str:
    """Return what a model can be set to, by channel where there are several."""
    if not isinstance(model, ScpiModel) or model.channels == 1:
        return f"{model.voltage_max_V} V, {model.current_max_A} A"
    numbers: dict[Rating, list[int]] = {}
    for number, rating in enumerate(model.ratings, 1):
        numbers.setdefault(rating, []).append(number)
    return "; ".join(
        f"channel {', '.join(map(str, which))}: {volts} V, {amps} A"
        for (volts, amps), which in numbers.items()
    )


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _quirks(rows: list[Model]) -> list[str]:
    """Return each quirk once, with whom it concerns."""
    found: dict[str, list[str]] = {}
    for model in rows:
        for quirk in model.quirks:
            found.setdefault(quirk, []).append(model.name)
    if not found:
        return []
    lines = [""]
    for quirk, names in found.items():
        whom = "all" if len(names) == len(rows) else ", ".join(names)
        lines.append(f"- {whom}: {quirk}.")
    return lines


def _faults() -> list[str]:
    return [FAULTS.format(faults=", ".join(f"`{fault}`" for fault in SimulatedFault))]


if __name__ == "__main__":
    main()
