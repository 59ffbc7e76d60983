"""The events of a run's journal in words."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

__all__ = ["sentence"]


def sentence(event: Mapping[str, Any]) -> str:
    """Tell a journal event in words; one that is not known here is told as it stands."""
    match event:
        case {"event": "asked", "run": run, "rest_s": rest, "steps": [[_, first], *_, [_, last]]}:
            return f"asked for {run}: {rest} s rest, then {first} V to {last} V"
        case {"event": "asked", "run": run, "rest_s": rest}:
            return f"asked for {run}: {rest} s rest"
        case {"event": "no_drive"}:
            return "this mode has no drive: the supply was not opened"
        case {"event": "prompt", "name": name, "text": text, "answer": answer}:
            return f"operator typed {name} = {answer}{_where(event)}: {text}"
        case {"event": "prompt", "text": text, "answer": answer}:
            return f"operator {answer}{_where(event)}: {text}"
        case {"event": "prepared", "identity": {"model": model, "serial": serial}}:
            return f"{model} {serial} prepared: limits set, output off"
        case {"event": "scale", "set_voltage_V": asked, "voltage_V": measured}:
            return f"scale checked: {asked:g} V set, {measured:g} V measured"
        case {"event": "cameras"}:
            return "cameras record"
        case {"event": "output_on", "volts": volts}:
            return f"output on at {volts} V"
        case {"event": "voltage", "read_back": volts}:
            return f"{volts} V set and read back"
        case {"event": "take_accepted" | "take_added", "file": file}:
            return f"take added: {PurePath(str(file)).name}"
        case {"event": "complete"}:
            return "measured to the end"
        case {"event": "failed" | "interrupted" | "safety-stop" as kind, "reason": reason}:
            return f"{kind}: {str(reason).splitlines()[0]}"
        case {"event": "output_off", "confirmed": confirmed}:
            return "output off, confirmed" if confirmed else "OUTPUT MAY BE ON, not confirmed"
    return ", ".join(f"{key} {value}" for key, value in event.items() if key != "time_s")


def _where(event: Mapping[str, Any]) -> str:
    return " in the panel" if event.get("where") == "panel" else ""
