"""A run in words: the events of its journal, and what was asked of it."""

from __future__ import annotations

from pathlib import PurePath

from workbench.bundle import events
from workbench.bundle.events import Event
from workbench.bundle.manifest import Asked

__all__ = ["condition_words", "sentence"]


def condition_words(asked: Asked) -> tuple[str, ...]:
    """Return what distinguishes a run's condition from others: mode, then speed, pull or height."""
    speed, pull, height = asked.speed_rad_s, asked.pull_N, asked.height_m
    return (
        asked.mode,
        *([f"{speed:.3g} rad/s"] if speed is not None else ()),
        *([f"{pull:g} N"] if pull is not None else ()),
        *([f"{1000 * height:g} mm"] if height is not None else ()),
    )


def sentence(event: Event) -> str:
    """Return a journal event in words; an unknown one as written."""
    match event:
        case events.RunAsked(run=run, rest_s=rest, steps=steps) if rest is not None:
            drive = f", then {steps[0][1]} V to {steps[-1][1]} V" if len(steps) > 1 else ""
            return f"asked for {run}: {rest} s rest{drive}{_started(event)}"
        case events.NoDrive():
            return "this mode has no drive: the supply was not opened"
        case events.PromptAnswered(where="nobody", name=name, text=text):
            return f"nobody was asked{f' for {name}' if name else ', nobody confirmed'}: {text}"
        case events.PromptAnswered(name=str(name), text=text, answer=answer):
            return f"operator typed {name} = {answer}{_where(event)}: {text}"
        case events.PromptAnswered(text=text, answer=answer):
            return f"operator {answer}{_where(event)}: {text}"
        case events.SupplyPrepared(identity=identity):
            return f"{identity.model} {identity.serial} prepared: limits set, output off"
        case events.Scale(set_voltage_V=asked, voltage_V=measured):
            return f"scale checked: {asked:g} V set, {measured:g} V measured"
        case events.CamerasStarted():
            return "cameras record"
        case events.OutputOn(volts=volts):
            return f"output on at {volts} V"
        case events.Voltage(read_back=volts):
            return f"{volts} V set and read back"
        case events.LiveTwinState(gone=str(gone)) if gone:
            return f"live twin gone: {gone}"
        case events.LiveTwinState():
            return _observed(event)
        case events.TakeWanted(folder=folder):
            return "waiting for the export" + (f" in {folder}" if folder else " to be named")
        case events.TakeRefused(file=file, reasons=reasons):
            why = f": {reasons[0].splitlines()[0]}" if reasons else ""
            return f"export {PurePath(file).name} does not belong to this run{why}"
        case events.TakeForced(file=file):
            return f"export {PurePath(file).name} taken all the same, as the operator insisted"
        case events.TakeAccepted(file=file) | events.TakeAdded(file=file):
            return f"take added: {PurePath(file).name}"
        case events.Complete():
            return "measured to the end"
        case events.Stopped(event=kind, reason=reason) if reason:
            return f"{kind}: {reason.splitlines()[0]}"
        case events.OutputOff(confirmed=confirmed):
            return "output off, confirmed" if confirmed else "OUTPUT MAY BE ON, not confirmed"
    return ", ".join(f"{key} {value}" for key, value in event.as_json().items())


def _observed(twin: events.LiveTwinState) -> str:
    delay = "" if twin.latency_ms is None else f", latency {twin.latency_ms[1]:.0f} ms at 99 %"
    error = "" if twin.error_mm is None else (
        f"; prediction error {twin.error_mm[0]:.1f} mm rms, at most {twin.error_mm[1]:.1f} mm"
    )  # fmt: skip
    counts = f"{twin.samples} samples, {twin.skipped} skipped, {twin.lost} lost"
    return f"live twin: {counts}{delay}{error}"


def _started(asked: events.RunAsked) -> str:
    """Return who started a run; bundles of before do not say."""
    if asked.operator is None:
        return ""
    where = "in the panel" if asked.where == "panel" else "at the terminal"
    return f"; started by {asked.operator} {where}"


def _where(prompt: events.PromptAnswered) -> str:
    return " in the panel" if prompt.where == "panel" else ""
