"""Filters in plain numpy, as their books write them, for vehicles of any kind.

They are the oracle of the compiled loops.
"""

from groundstation.estimators.cooperative.plain.centralised import run_centralised
from groundstation.estimators.cooperative.plain.decentralised import run_decentralised
from groundstation.estimators.cooperative.plain.pairwise import run_pairwise

__all__ = ["run_centralised", "run_decentralised", "run_pairwise"]
