"""Process noise between two steps."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from workbench.fit import NOISE_FACTOR, between_steps, weaker


@dataclass(frozen=True)
class Certain:
    """An estimator whose likelihood is a parabola in the logarithm of the noise of each group."""

    noise: dict[str, float]
    lands: bool = False

    @property
    def system(self) -> Any:
        return SimpleNamespace(
            groups=("beam", "foot", "absent"), names=("one",), lands=lambda run: self.lands
        )

    def depends_on(self, group: str) -> bool:
        return group != "absent"

    def with_noise(self, noise: dict[str, float]) -> Certain:
        return Certain(noise, self.lands)

    def log_likelihood(self, x: Any) -> float:
        best = {"beam": 0.65, "foot": 40.0}
        return -sum(float(np.log(self.noise[g] / q)) ** 2 for g, q in best.items())


def found(*, lands: bool = False) -> dict[str, float]:
    begin: Any = Certain({"beam": 1.0, "foot": 1.0, "absent": 1.0}, lands)
    return dict(between_steps(begin, np.zeros(0)).noise)


def test_noise_is_taken_between_two_steps_and_no_farther_than_half_of_one() -> None:
    noise = found()
    assert noise["beam"] == pytest.approx(0.65)
    assert noise["foot"] == pytest.approx(NOISE_FACTOR**0.5)
    assert noise["absent"] == 1.0


def test_where_a_foot_lands_noise_stays() -> None:
    assert found(lands=True) == {"beam": 1.0, "foot": 1.0, "absent": 1.0}


def test_the_noise_of_one_group_is_a_step_weaker() -> None:
    begin: Any = Certain({"beam": 1.0, "foot": 1.0, "absent": 1.0})
    noise = weaker(begin, "foot").noise
    assert noise == {"beam": 1.0, "foot": pytest.approx(10**-0.5), "absent": 1.0}
