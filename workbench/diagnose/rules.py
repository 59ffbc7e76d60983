"""The numbers that can change an answer, all of them; every answer prints them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import scipy

__all__ = ["RULES", "RULES_OF_RIGS", "Rules"]


@dataclass(frozen=True)
class Rules:
    """Thresholds of a diagnosis.

    A cost is -2 ln of a posterior; it counts divided by how often the innovations repeat one
    another. Gains are sums over seconds, sure by their own scatter from second to second.

    Args:
        shortlist: candidates that are fitted in full.
        seconds: candidates that are fitted beside the best.
        promising: share of the greatest promised gain that a candidate must promise for that; of
            the gain of two causes or more that one more beside them must have.
        promised: share of a practical size that it must promise; what is large promises less than
            it holds, for residuals are not straight so far.
        near: share of the best gain within which a candidate's process noise is weighed anew.
        least_gain: gain of a cause of one number that is no chance: 1 in 16,000, for some thirty.
        suspected: gain of one that may well be there: 1 in 200.
        size: gain for each sample that can show a cause, of a practical size: (0.08 sigma)^2.
        sure: gain over its scatter, of a cause against none.
        agree: share of the runs held out that can show it, which must prefer it.
        apart: gain over its scatter, of a cause against another, and of one that may be there.
        material: share of what is missing that a cause must explain to be listed, where more is
            left than a whole model may miss.
        explained: share that it must explain to be named there.
        whole: of the noise, root mean square of a drive that misses nothing.
        noise_share: of the strong process noise: what a model that misses nothing may ask for.
    """

    shortlist: int = 5
    seconds: int = 3
    promising: float = 0.1
    promised: float = 0.25
    near: float = 0.5
    least_gain: float = 16.0
    suspected: float = 8.0
    size: float = 0.0064
    sure: float = 2.0
    agree: float = 0.5
    apart: float = 1.64
    material: float = 0.5
    explained: float = 0.8
    whole: float = 1.15
    noise_share: float = 0.5

    def practical(self, samples: float, numbers: int = 1) -> float:
        """Return the gain that is no chance and of a practical size.

        Args:
            samples: of all channels, over how often they repeat one another.
            numbers: that are released for it.
        """
        return max(self.no_chance(numbers), self.size * samples)

    def no_chance(self, numbers: int) -> float:
        """Return the gain that is no chance where so many numbers are released."""
        return _as_rare(self.least_gain, numbers)

    def maybe(self, numbers: int) -> float:
        """Return the gain of what may well be there where so many numbers are released."""
        return _as_rare(self.suspected, numbers)


@cache
def _as_rare(gain: float, numbers: int) -> float:
    """Return the gain by so many numbers that is as rare by chance as one by a single number.

    By chance a gain is distributed as chi-squared with as many degrees of freedom (Wilks, Ann.
    Math. Stat. 9, 1938, 60).
    """
    return float(scipy.stats.chi2.isf(scipy.stats.chi2.sf(gain, 1), numbers))


RULES = Rules()

RULES_OF_RIGS = Rules(size=0.0144)
"""Of a machine nothing is known but its file, and what it misses besides any cause is not below
(0.12 sigma)^2: a measured pendulum was named by gains of 23 and 59, with errors 90 times the noise.
"""
