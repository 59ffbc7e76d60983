"""What a technician is told of a quantity."""

from __future__ import annotations

import pytest

from workbench.diagnose import Amount
from workbench.sim import EFFECTS


@pytest.mark.parametrize(
    ("mass", "told"),
    [
        (
            Amount(0.004, -0.001, 0.009, "kg"),
            "the top is heavier than the model says by 0.00400 kg (-0.00100 to 0.00900)",
        ),
        (
            Amount(-0.004, -0.009, 0.001, "kg"),
            "the top is lighter than the model says by 0.00400 kg (-0.00100 to 0.00900)",
        ),
        (Amount(0.0, -0.001, 0.001, "kg"), "the top is heavier than the model says by 0 kg"),
    ],
)
def test_a_sentence_follows_the_sign_of_its_quantity(mass: Amount, told: str) -> None:
    assert EFFECTS["top_mass"].sentence.format(mass=mass).startswith(told)


def test_a_share_is_told_in_percent_with_its_interval_turned() -> None:
    share = Amount(-0.05, -0.08, -0.02, "1")
    told = EFFECTS["hinge_stiffness"].sentence.format(share=share)
    wanted = "the beam's hinges are softer than the model says by 5.00 % (2.00 to 8.00 %)"
    assert told == wanted


def test_a_quantity_without_a_word_keeps_its_sign() -> None:
    tilt = Amount(-0.003, -0.004, -0.002, "rad")
    told = EFFECTS["camera_tilt"].sentence.format(tilt=tilt)
    assert "leans by -0.00300 rad (-0.00400 to -0.00200)" in told
