"""Compile the loops of cleaning, so that the first take does not wait for it.

python -m workbench.tracking
"""

import numpy as np

from workbench.tracking.loops import fit, median_of_five, smooth, steady, visible, whole

__all__: list[str] = []

if __name__ == "__main__":
    cloud, both = np.zeros((3, 3, 4)), np.ones(3, dtype=np.bool_)
    whole(cloud)
    steady(cloud, 1.0)
    fit(np.eye(3), np.ones(3), cloud, visible(cloud, both), np.empty((13, 4)))
    smooth(median_of_five(cloud[0]), np.ones(4, dtype=np.bool_), 1.0)
