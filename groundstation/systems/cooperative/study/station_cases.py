"""Cases of the study of stations: written down before they were flown.

The first family keeps every assumption of the test: stations right, or one misplaced by 50, 150 or 500 m in every
direction, with one, two and three ground points, known clocks and unknown ones, with satellites. The second breaks
them: range errors that stay for 5 and 30 s, INS and clocks worse than believed, a station with a wrong clock, two
stations off at once.
"""

from dataclasses import fields, replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.datums import DATUMS
from groundstation.simulation.session_scenario import (
    SessionErrorSigmas,
    SessionPoint,
    SessionScenario,
    load_session,
)
from groundstation.systems.cooperative.settings import CooperativeSettings, InsBelief

FIRST_SEED = 90_000
THIRD = SessionPoint("N3", 20_000.0, 90_000.0)
FOURTH = SessionPoint("N4", -60_000.0, -40_000.0)


@dataclass(frozen=True)
class StationCase:
    """Case of the study of stations.

    Parameters
    ----------
    name, title : str
    session : str
        Shipped session.
    points : tuple of SessionPoint
        Added to those of the session.
    off_m : float
        By how much the last station (of the session's own points) is misplaced; its direction goes round with the run.
    second_off_m : float
        Likewise of the first station.
    delay_m : float
        By how much the ranges of the last one are too long.
    worse : dict
        Errors of INS and clocks (fields of InsBelief), as multiples of what the filter believes.
    lasting_s : float
        Correlation time of half of the variance of ranges; 0: they are white.
    believed : dict
        Sigmas of the session that this case replaces, in truth and belief alike.
    datum : str
        Datum that the stations file is in by mistake.
    stated_sigma_m : float
        Sigma of the stations' places, as stated and as drawn.
    is_breaking : bool
        It breaks the assumptions of the test.
    asks_plainly : bool
        The plain test of the filter's innovations is asked too.
    """

    name: str
    title: str
    session: str = "local-three-two-points"
    points: tuple[SessionPoint, ...] = ()
    off_m: float = 0.0
    second_off_m: float = 0.0
    delay_m: float = 0.0
    worse: tuple[tuple[str, float], ...] = ()
    lasting_s: float = 0.0
    believed: tuple[tuple[str, float], ...] = ()
    datum: str = ""
    stated_sigma_m: float = 0.0
    is_breaking: bool = False
    asks_plainly: bool = False

    @property
    def is_wrong(self) -> bool:
        """Tell whether any station is."""
        return bool(self.off_m or self.second_off_m or self.delay_m or self.datum)

    def scenario(self) -> SessionScenario:
        """Return what the filter believes."""
        scenario = load_session(self.session)
        points = tuple(replace(one, position_sigma_m=self.stated_sigma_m) for one in (*scenario.points, *self.points))
        return replace(scenario, points=points, errors=_errors(scenario.errors, dict(self.believed)))

    def true_scenario(self) -> SessionScenario:
        """Return what the session is drawn from."""
        scenario = self.scenario()
        errors = _errors(scenario.errors, {name: by * getattr(scenario.errors, name) for name, by in self.worse})
        white = np.sqrt(0.5) if self.lasting_s else 1.0
        return replace(
            scenario, errors=errors, link=replace(scenario.link, range_sigma_m=white * scenario.link.range_sigma_m)
        )

    def settings(self) -> CooperativeSettings:
        """Return the filter's settings."""
        errors = self.scenario().errors
        belief = InsBelief(**{item.name: getattr(errors, item.name) for item in fields(InsBelief)})
        return CooperativeSettings(ins=belief, map_window_s=0.0)


def _errors(errors: SessionErrorSigmas, changed: dict[str, float]) -> SessionErrorSigmas:
    return replace(errors, **changed)  # type: ignore[arg-type]


KNOWN_CLOCKS = (("clock_m", 0.1), ("clock_mps", 0.01))
GOOD_INS = (("position_m", 20.0), ("velocity_mps", 0.05))
ONE, THREE, FOUR = "local-three-one-point", (THIRD,), (THIRD, FOURTH)
SK_42 = DATUMS[0].name
CASES: tuple[StationCase, ...] = (
    StationCase("two-right", "2 points, right", asks_plainly=True),
    StationCase("one-right", "1 point, right", ONE),
    StationCase("three-right", "3 points, right", points=THREE),
    StationCase("two-right-known-clocks", "2 points, right, clocks known", believed=KNOWN_CLOCKS),
    StationCase("two-surveying", "2 points, right, stated sigma 100 m", stated_sigma_m=100.0),
    StationCase("two-50", "2 points, one 50 m off", off_m=50.0),
    StationCase("two-150", "2 points, one 150 m off", off_m=150.0),
    StationCase("two-500", "2 points, one 500 m off", off_m=500.0, asks_plainly=True),
    StationCase("two-500-known-clocks", "2 points, one 500 m off, clocks known", off_m=500.0, believed=KNOWN_CLOCKS),
    StationCase("one-500", "1 point, 500 m off", ONE, off_m=500.0),
    StationCase("three-50", "3 points, one 50 m off", points=THREE, off_m=50.0),
    StationCase("three-500", "3 points, one 500 m off", points=THREE, off_m=500.0),
    StationCase("four-500-500", "4 points, two 500 m off", points=FOUR, off_m=500.0, second_off_m=500.0),
    StationCase("two-datum", "2 points in SK-42, INS good to 20 m", datum=SK_42, believed=GOOD_INS),
    StationCase("two-datum-poor", "2 points in SK-42, INS good to 300 m", datum=SK_42),
    StationCase("lasting-5", "2 points, right, errors last 5 s", lasting_s=5.0, is_breaking=True),
    StationCase("lasting-30", "2 points, right, errors last 30 s", lasting_s=30.0, is_breaking=True),
    StationCase(
        "worse-ins",
        "2 points, right, INS twice as bad as believed",
        worse=(("position_m", 2.0), ("velocity_mps", 2.0)),
        is_breaking=True,
    ),
    StationCase(
        "worse-clocks",
        "2 points, right, clocks three times as bad",
        worse=(("clock_m", 3.0), ("clock_mps", 3.0)),
        is_breaking=True,
    ),
    StationCase(
        "lasting-30-500", "2 points, one 500 m off, errors last 30 s", off_m=500.0, lasting_s=30.0, is_breaking=True
    ),
    StationCase(
        "worse-ins-500",
        "2 points, one 500 m off, INS twice as bad",
        off_m=500.0,
        worse=(("position_m", 2.0), ("velocity_mps", 2.0)),
        is_breaking=True,
    ),
    StationCase("delay-300", "2 points, clock of one 1 us off (300 m)", delay_m=300.0, is_breaking=True),
    StationCase("three-delay-300", "3 points, clock of one 1 us off", points=THREE, delay_m=300.0, is_breaking=True),
)
