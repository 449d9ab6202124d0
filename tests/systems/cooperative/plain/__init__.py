"""Filters in plain numpy, as their books write them, for vehicles of any kind.

They are the oracle of the filters of the package, which make the same of fewer and larger steps.
"""

from tests.systems.cooperative.plain.centralised import run_centralised
from tests.systems.cooperative.plain.decentralised import run_decentralised
from tests.systems.cooperative.plain.pairwise import run_pairwise

__all__ = ["run_centralised", "run_decentralised", "run_pairwise"]
