"""Searches by one interface: ask for candidates, tell their fitness; less is better.

`space` is the set that is searched and `algorithm` the contract; `genetic` is the algorithm of the
thesis, `guided` the default search, which learns by `surrogate`, `cma_es` the one that needs no
descriptors, `pareto` the one for several goals. `search` is the loop,
`evaluation` the fitness of one, `history` what was done, `checkpoint` the file that a search
goes on from. `design.search_figures` draws what a search looks like.

The room knows numbers only: no robot, no file of the workbench but its own checkpoint. A new
algorithm is one file with a subclass of `Algorithm`, and its name in `tests/optimize/contract.py`.
"""

from typing import TYPE_CHECKING

from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.cma_es import Cmaes, CmaesOptions
from workbench.optimize.evaluation import Evaluate, Evaluation, candidate_key
from workbench.optimize.genetic import GeneticAlgorithm, GeneticOptions
from workbench.optimize.guided import Guided, GuidedOptions
from workbench.optimize.history import Generation, History, Trial
from workbench.optimize.niches import Describe, Likely, Possible
from workbench.optimize.pareto import Pareto, ParetoOptions
from workbench.optimize.search import Watch, search
from workbench.optimize.space import Space
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
