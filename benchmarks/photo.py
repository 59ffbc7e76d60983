"""How near the read-back comes to known angles, over many synthetic photographs.

    python benchmarks/photo.py [--photos 32] [--quick]

Every photograph shows another strip, bent wrong by 2 degrees (standard deviation) at each joint,
seen by another camera: place, tilt, focal length, lens (radial to sixth order and decentred, which
the reader does not model in full), lamp, glare, side of the strip, blur, noise, JPEG. The strip
lies on the foot line, so that all 16 angles are seen. A pull is an error over its own standard
error: honest ones have a standard deviation of 1, and 90 % intervals hold 90 % of the truths.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.photo.rendering import TARGET, random_scene, render
from workbench.errors import InputError
from workbench.photo import read_photo

BAR_DEG = 0.3
COVERAGE = (0.80, 0.98)
OFF_RAD = np.radians(2.0)
SIZE = 2400, 1800
QUICK_SIZE = 1600, 1200
FIRST_SEED = 1000
WITHIN_90 = float(norm.ppf(0.95))


class Reading(NamedTuple):
    """One photograph read.

    Args:
        error: (16,) read less true [rad].
        pull: (16,) error over its standard error.
        seconds: of processor time to read it.
        residual_mm: of the board's corners.
    """

    error: NDArray[np.float64]
    pull: NDArray[np.float64]
    seconds: float
    residual_mm: float


def readings(photos: int, size: tuple[int, int], folder: Path) -> Iterator[Reading | InputError]:
    """Render and read one photograph after the other."""
    for seed in range(FIRST_SEED, FIRST_SEED + photos):
        scene = random_scene(seed, size, OFF_RAD, aligned=True)
        path = folder / f"photo-{seed}.jpg"
        path.write_bytes(render(scene))
        begin = time.process_time()
        try:
            bent = read_photo(path, TARGET, foot_aligned=True)
        except InputError as error:
            yield error
            continue
        seconds = time.process_time() - begin
        off, error = bent.angles - scene.angles, bent.uncertainty
        assert error is not None
        yield Reading(off, off / error, seconds, bent.notes["board_residual_mm"])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--photos", type=int, default=32)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    photos, size = (2, QUICK_SIZE) if asked.quick else (asked.photos, SIZE)
    read: list[Reading] = []
    refused: list[InputError] = []
    print(f"{photos} photographs of {size[0]} x {size[1]} pixels")
    print("photo  rms [deg]  worst [deg]  rms pull  board [mm]  cpu [s]")
    with tempfile.TemporaryDirectory() as folder:
        for k, one in enumerate(readings(photos, size, Path(folder))):
            if isinstance(one, InputError):
                refused.append(one)
                print(f"{k:5d}  refused: {one}", flush=True)
                continue
            read.append(one)
            rms, worst = (np.degrees(f(one.error)) for f in (_rms, lambda e: np.abs(e).max()))
            print(
                f"{k:5d}  {rms:9.3f}  {worst:11.3f}  {_rms(one.pull):8.2f}  "
                f"{one.residual_mm:10.3f}  {one.seconds:7.1f}",
                flush=True,
            )
    if read:
        _summarize(read, len(refused))


def _summarize(read: list[Reading], refused: int) -> None:
    errors = np.degrees(np.array([one.error for one in read]))
    pulls = np.array([one.pull for one in read])
    print("\njoint  rms [deg]  mean pull  sd of pull  in 90 %")
    for joint in range(errors.shape[1]):
        own = pulls[:, joint]
        print(
            f"{joint:5d}  {_rms(errors[:, joint]):9.3f}  {own.mean():+9.2f}  {own.std():10.2f}  "
            f"{np.mean(np.abs(own) < WITHIN_90):7.0%}"
        )
    held = float(np.mean(np.abs(pulls) < WITHIN_90))
    print(f"\nrefused: {refused} of {refused + len(read)}")
    worst, middle = np.abs(errors).max(), np.median(np.abs(pulls))
    low, high = COVERAGE
    print(f"angles, rms: {_rms(errors):.3f} deg (bar {BAR_DEG:g}), worst {worst:.3f}")
    print(f"90 % intervals hold {held:.1%} of the truths (bar {low:.0%} to {high:.0%})")
    print(f"pulls: rms {_rms(pulls):.2f}, median |pull| {middle:.2f} (honest 0.67)")


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
