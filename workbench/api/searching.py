"""A better beam, searched for in a folder of its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.progress import Progress
    from workbench.report import Searched

__all__ = ["optimize_shape"]


def optimize_shape(
    omega: float = 17.0,
    *,
    goal: str | Sequence[str] = "distance",
    algorithm: str = "guided",
    evaluations: int = 480,
    duration: float = 10.0,
    seed: int = 0,
    model: str | Path = "thesis",
    shape: str | Path = "thesis-initial",
    vary: Sequence[str] = (),
    bounds: str = "thesis",
    robust: bool = False,
    out: str | Path | None = None,
    progress: Progress = lambda text: None,
) -> Searched:
    """Search for a beam that hops farther, or is better in another way, as `workbench optimize`.

    Args:
        omega: speed of the rotor [rad/s].
        goal: `distance`, `height`, `cost` or `stability`; two of them for a Pareto front.
        algorithm: `guided`, `cma`, `ga`, or `pareto` with two goals.
        evaluations: candidates to try.
        duration: of a hop [s].
        seed: the same one, the same search.
        model: built-in name, or path of a model file.
        shape: where the search begins, built-in name or path.
        vary: other variables, each as `NAME=LOWER:UPPER` [SI]: omega or a parameter of the model.
        bounds: of the angles, `thesis` or `appendix-e`.
        robust: whether a candidate is judged by mean and spread over what may be built.
        out: folder of the search; by default `searches/TIME`.
        progress: called with each generation, such as `print`.

    Returns:
        `found`, best first, with `values` by name and unit, the file `shape` of the best, the
        `history` and the page, `report`.

    Raises:
        InputError: when a name does not exist, or the folder holds a search already.
        WorkbenchError: when no candidate hopped to its end.

    Example:
        >>> better = wb.optimize_shape(omega=17, evaluations=96, duration=4)
        >>> wb.simulate(17, shape=better.shape).summary["distance_m"]
    """
    from workbench.design import Settings, Study
    from workbench.report import finish_search, search_folder
    from workbench.schemas import load_model, load_shape
    from workbench.sim import Fanout

    goals = (goal,) if isinstance(goal, str) else tuple(goal)
    settings = Settings(
        omega, duration, algorithm, goals, bounds, tuple(vary), robust, seed=seed,
        evaluations=evaluations,
    )  # fmt: skip
    folder = search_folder(Path("searches")) if out is None else Path(out)
    start = load_shape(str(shape), Path())
    study = Study.begin(folder, settings, load_model(str(model), Path()), start)
    with Fanout() as fanout:
        history = study.run(fanout, progress)
    return finish_search(study, history)
