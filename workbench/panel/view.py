"""What the page shows, in words: made from what is known of the controller and of its run."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from workbench.output import FOUND, MAY_BE_ON, OutputState
from workbench.panel.controller import Controller
from workbench.panel.estimate import remaining_s
from workbench.panel.journal_tail import JournalTail
from workbench.panel.result import result

__all__ = ["FRONT_SWITCH", "NOTHING_TO_STOP", "clocks", "view"]

FRONT_SWITCH = "the switch on the supply's front, or the emergency stop"
NOTHING_TO_STOP = f"There is no run to stop. If anything moves, use {FRONT_SWITCH}."
LOG_LINES = 60

_ENDED = {
    "complete": ("good", "Complete"),
    "ended": ("plain", "Ended by the operator"),
    "Interrupted": ("plain", "Stopped by the user"),
    "KeyboardInterrupt": ("plain", "Stopped by the user"),
    "SafetyStop": ("alarm", "Safety stop"),
    "GeneratorExit": ("plain", "Ended"),  # whoever asked for the runs wanted no more
}


class _Banner(NamedTuple):
    """What is shown above everything else.

    Args:
        level: `alarm`, `bad`, `plain` or `good`.
        title: a few words.
        text: what it means, and what to do.
    """

    level: str
    title: str
    text: str


def view(
    controller: Controller, following: JournalTail | None, verdict: tuple[int, int] = (0, 0)
) -> dict[str, Any]:
    """Return everything that is shown, but for times and readings.

    Args:
        controller: who carries out the run.
        following: the run.
        verdict: how many runs of the experiment were judged, and how many of them failed.
    """
    fact, published = controller.fact, controller.published
    alive = controller.state in ("alive", "silent")
    known = None if following is None else following.output  # reads the run's files, so once
    banner = _banner(controller, following, known, verdict)
    return {
        "controller": controller.state,
        "title": fact.get("title", ""),
        "protocol": Path(fact.get("protocol", "")).name,
        "bench": fact.get("bench", ""),
        "pid": fact.get("pid"),
        "operator": fact.get("operator", ""),
        "started_here": fact.get("start") is not None,
        "others": controller.others,
        "banner": None if banner is None else banner._asdict(),
        "phase": published.get("phase", "") if alive else "",
        "notice": published.get("notice", "") if alive else "",
        "question": _question(controller),
        "stops": published.get("stops", 0),
        "live": published.get("live") if alive else None,
        "pausing": bool(published.get("pausing")) and alive,
        "run": _run(controller, following),
        "result": None if following is None else result(following.bundle),
        "output": _output(controller, known),
        "log": [] if following is None else following.notices[-LOG_LINES:],
    }


def clocks(controller: Controller, following: JournalTail | None) -> dict[str, Any]:
    """Return the times [s] that the page lets run on by itself; null where there is none."""
    fact, published = controller.fact, controller.published
    if not fact or "began" not in fact:
        return {"elapsed_s": None, "run_s": None, "remaining_s": None, "running": False}
    running = controller.state == "alive"
    silent_s = time.monotonic() - controller.last_answer  # since its last message
    elapsed = time.time() - datetime.fromisoformat(fact["began"]).timestamp()
    run_s = 0.0 if following is None else following.run_s
    number = None if following is None else following.number
    remaining = remaining_s(
        fact["items"],
        number,
        float("inf") if following is not None and following.ended else run_s,
        published.get("phase", ""),
        published.get("since", 0.0),
    )
    return {
        "elapsed_s": round(elapsed - (0.0 if running else silent_s), 2),
        "run_s": round(run_s, 2) if running or (following and following.ended) else None,
        "remaining_s": round(remaining, 2) if running else None,
        "running": running,
    }


def _question(controller: Controller) -> dict[str, Any] | None:
    """Return the prompt that waits for an answer; where its picture lies is not the page's."""
    asked = controller.published.get("question")
    if asked is None or controller.state != "alive":
        return None
    return asked | {"picture": asked["picture"] is not None}


def _run(controller: Controller, following: JournalTail | None) -> dict[str, Any] | None:
    """Return the run that was begun last, with what its plan says."""
    if following is None:
        return None
    asked = following.bundle.manifest.asked
    if asked is None:
        return None
    items = controller.fact.get("items", ())
    item = next((one for one in items if one.get("number") == asked.number), {})
    return {
        "name": following.bundle.path.name,
        "number": asked.number,
        "of": asked.of,
        "mode": asked.mode,
        "asked": item.get("asked", ""),
        "seconds": item.get("seconds"),
        "rest_s": item.get("rest_s"),
        "filming": following.filming,
        "ended": following.ended,
    }


def _output(controller: Controller, known: OutputState | None) -> dict[str, str]:
    """Return what is known of the supply's output; what nobody watches any more may be on."""
    if known is None:
        return {"level": "plain", "text": "not on yet" if controller.state == "alive" else ""}
    watched = controller.state == "alive"
    match known.state:
        case "off":
            return {"level": "plain", "text": "off, confirmed"}
        case "on" if watched:
            return {"level": "live", "text": "on"}
        case "untouched" | "not driven":
            return {
                "level": "plain",
                "text": "not switched" if controller.state == "gone" else "not on yet",
            }
        case "unknown" if watched and known.cause == FOUND:
            return {"level": "plain", "text": "not known yet"}  # it is being prepared
        case _:
            return {"level": "alarm", "text": "MAY BE ON"}


def _banner(
    controller: Controller,
    following: JournalTail | None,
    known: OutputState | None,
    verdict: tuple[int, int],
) -> _Banner | None:
    match controller.state:
        case "gone":
            title = controller.fact.get("title", "a run")
            died = (
                f"Process {controller.fact.get('pid')}, which carried out “{title}”, ended without "
                "a word: it was killed, or crashed."
            )
            return _Banner("alarm", "Controller gone", f"{died} {_output_text(following, known)}")
        case "silent":
            return _Banner(
                "alarm",
                "Controller does not answer",
                f"Process {controller.fact.get('pid')} hangs. Where its output is on, its guardian "
                f"switches off within a second. If anything moves, use {FRONT_SWITCH}.",
            )
        case "ended":
            ended = controller.published["ended"]
            level, title = _ENDED.get(ended["kind"], ("alarm", "Failed"))
            if "OUTPUT MAY BE ON" in ended["text"]:
                level = "alarm"
            if ended["kind"] not in ("complete", "ended"):
                return _Banner(level, title, ended["text"])
            return _judged(level, title, *verdict)
        case _:
            return _doubt(known)


def _judged(level: str, title: str, judged: int, failed: int) -> _Banner:
    """Say of an experiment that ended whether its runs are as the protocol expects."""
    if failed:
        words = "FAIL" if judged == 1 else f"{failed} of {judged} runs FAIL"
        return _Banner("bad", f"{title}: {words}", "Not as the protocol expects.")
    words = {0: "", 1: ": pass"}.get(judged, f": all {judged} runs pass")
    return _Banner(level, f"{title}{words}", "")


def _doubt(known: OutputState | None) -> _Banner | None:
    """Say at once that a supply that is driven does not answer."""
    if known is None or known.state != "unknown" or known.cause == FOUND:
        return None
    return _Banner("alarm", MAY_BE_ON, f"{known.cause}. Use {FRONT_SWITCH} now.")


def _output_text(following: JournalTail | None, known: OutputState | None) -> str:
    """Return what became of the output of a run whose process died."""
    if following is None or known is None or known.state in ("untouched", "not driven"):
        return "It had not touched the supply."
    trips = following.bundle.record.trips
    if known.state == "off":
        if not trips:
            return "Its output was off."
        return f"Its guardian switched the output off, and read back that it is off ({trips[-1]})."
    if trips is None:
        return f"No guardian watched its output. {MAY_BE_ON}: use {FRONT_SWITCH} now."
    cause = f" ({known.cause})" if known.cause else ""
    return f"{MAY_BE_ON}: its guardian has not confirmed off{cause}. Use {FRONT_SWITCH} now."
