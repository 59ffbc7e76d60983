"""What a right answer to a case is, as its sealed label has it."""

from __future__ import annotations

from benchmarks.bank.cases import Case

__all__ = ["expected"]

_SENSOR = {"camera_tilt", "length_scale", "marker_offset", "time_offset"}
"""Effects that are faults of the data: with their name, both answers are right."""

_SENSOR_EFFECTS = {
    "late_rotor": ["time_offset"],
    "tilt": ["camera_tilt"],
    "wrong_scale": ["length_scale"],
    "swapped_axes": [],
    "swapped_labels": [],
}
"""Fault -> effects whose name says the same."""

_TRAPS: dict[str, tuple[list[str], list[str], list[str]]] = {
    "mass_and_stiffness": (["CLEAN"], [], ["top_mass", "hinge_stiffness", "root_stiffness"]),
    "half_percent_speed": (["CLEAN", "NAMED", "SET"], [], ["speed_scale", "speed_offset"]),
    "nothing_slips": (["CLEAN"], [], []),
    "unseen_coulomb": (
        ["CLEAN", "SET"],
        [],
        ["hinge_coulomb_friction", "hinge_damping", "hinge_quadratic_damping"],
    ),
    "softening": (["NAMED"], ["hinge_cubic_stiffness"], ["hinge_cubic_stiffness"]),
    "slope_or_set": (["SET"], ["ground_slope", "rest_shape_drift"], []),
    "droop_near_resonance": (["NAMED"], ["motor_droop"], ["motor_droop"]),
    "clutter_only": (["CLEAN", "NONE"], [], []),
    "bad_trackable": (["DATA_FAULT", "CLEAN", "NONE"], [], []),
    "one_run": (["DATA_FAULT", "NONE", "NAMED", "SET"], [], ["rest_shape_drift"]),
}
"""Trap -> answers that are right, causes that must be listed, causes that NAMED may list."""


def expected(case: Case) -> dict[str, list[str]]:
    """Return the right answers, what they must list and what a NAMED one may list."""
    causes = list(case.causes)
    name = ["NAMED", "DATA_FAULT"] if set(causes) <= _SENSOR else ["NAMED"]
    if case.block == "single":
        return _expectation([*name, "SET"] if case.sizes[0] < 1 else name, causes, causes)
    if case.block == "null":
        return _expectation(["CLEAN"], [], [])
    if case.block == "pair":
        return _expectation(name, causes, causes)
    if case.block == "outside":
        return _expectation(["NONE", "PARTIAL"], [], [])
    if case.block == "tie":
        return _expectation(["SET"], causes, causes[:1])
    if case.block == "sensor":
        return _expectation(["DATA_FAULT", "NAMED"], [], _SENSOR_EFFECTS[case.kind])
    return _expectation(*_TRAPS[case.kind])


def _expectation(answers: list[str], listed: list[str], named: list[str]) -> dict[str, list[str]]:
    return {"answers": answers, "listed": listed, "named": named}
