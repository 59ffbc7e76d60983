"""Two plain engines, which a diagnosis must beat on the same cases.

They get more than they could find themselves: the fits of the real one. `single` names the one
cause that fits the training runs best, always. `bic` takes of robot and drive each the causes that
make the Bayesian information criterion least, counting every sample.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.diagnose import Diagnosis

__all__ = ["NAMES", "bic", "plain_answers", "single"]

NAMES = ("single", "bic")


def plain_answers(found: Diagnosis) -> dict[str, dict[str, object]]:
    """Return what each says of a case that was diagnosed, as `workbench diagnose --json` would."""
    return {"single": single(found), "bic": bic(found)}


def single(found: Diagnosis) -> dict[str, object]:
    """Name the cause whose release lowers the cost of the training runs most."""
    gains = {
        one.names[0]: gains.gain
        for part in found.parts.values()
        for one, gains in part.compared
        if len(one.names) == 1
    }
    return _named([max(gains, key=lambda name: gains[name])] if gains else [])


def bic(found: Diagnosis) -> dict[str, object]:
    """Name all causes that the criterion asks for; none is CLEAN."""
    chosen: list[str] = []
    count = np.log(found.observer.fits.samples())
    for part in found.parts.values():
        least, names = 0.0, tuple[str, ...]()
        for one, gains in part.compared:
            criterion = len(one.names) * count - gains.gain
            if criterion < least:
                least, names = criterion, one.names
        chosen += names
    return _named(chosen)


def _named(causes: Sequence[str]) -> dict[str, object]:
    return {
        "answer": "NAMED" if causes else "CLEAN",
        "causes": [{"effect": name, "parameters": {}} for name in causes],
    }
