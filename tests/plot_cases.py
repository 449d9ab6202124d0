"""Results with plots of every kind, each made once."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from groundstation.base.clock import Clock
from groundstation.base.ledger import Ledger
from groundstation.chapters.generic import SERIES, columns_by_unit
from groundstation.pipeline.one_flight.analyse import Given, analyse, run_analyses
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.join import join_logs
from groundstation.pipeline.one_flight.log import open_log
from groundstation.results.answer import Answer, by_analysis
from groundstation.results.arrays.flight import GnssLanes, Overview, StateLanes
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, Source
from groundstation.simulation.session import simulate_session
from groundstation.systems.cooperative.analysis import COOPERATIVE
from groundstation.systems.gnss.answer import GnssReception
from groundstation.systems.health.answer import AutopilotHealth
from groundstation.systems.inertial.units import judge_units
from groundstation.systems.known import SessionKnown
from groundstation.systems.landing.answer import LandingResult
from groundstation.systems.landing.arrays import LandingPath, LandingProtection
from groundstation.systems.plan import Planned
from groundstation.systems.planning.landing.plan import LANDING_PLAN
from groundstation.systems.planning.session.plan import plan_session
from groundstation.systems.planning.session.scenario import KeepOut
from groundstation.systems.reference.answer import ReferenceResult
from groundstation.systems.several_logs.answer import Together
from groundstation.tables.table import Flight
from tests import report_example, viewer_example
from tests.systems.inertial import causes_example
from tests.systems.inertial.example import aided_figures, forecast_result, inertial_result
from tests.systems.inertial.units_example import drift_of, gnss, units

MOST_GENERIC = 3  # figures of an answer without a chapter: all are told alike
LAKE = KeepOut("lake", ((-1800.0, 500.0), (-1800.0, 1400.0), (-1000.0, 1400.0)))


@cache
def report() -> FlightResults:
    """Taxi, standstill and the whole flight, and an INS with its forecast."""
    return report_example.example(report_example.heading_result(), inertial_result(), forecast_result())


@cache
def viewer() -> FlightResults:
    """A short flight with UTC."""
    return viewer_example.make_results(viewer_example.make_flight())


@cache
def aided() -> FlightResults:
    """An INS that GNSS corrects, and no heading."""
    results = report_example.example()
    return replace(results, figures=(*results.figures, *aided_figures(results.duration_s)))


@cache
def several_units() -> FlightResults:
    """Three INS, one of which drifts."""
    return report_example.example(judge_units(units(3, bad=drift_of(0.3)), gnss()))


@cache
def by_cause() -> FlightResults:
    """An unaided INS, its errors by cause."""
    return report_example.example(causes_example.causes())


@cache
def bare() -> FlightResults:
    """Nothing at all."""
    return replace(report_example.example(), figures=())


@cache
def flown() -> FlightResults:
    """A whole simulated flight with everything that is asked of one: latency, spectrum, reference."""
    from tests.systems.latency.test_estimate import flown

    return analysed(flown(0.2))


@cache
def joined() -> FlightResults:
    """Two logs as one flight."""
    from tests.test_formats_agree import as_ubx, as_ulog

    with TemporaryDirectory() as folder:
        place = Path(folder)
        as_ulog(place / "a.ulg")
        as_ubx(place / "b.ubx")
        target = place / "joined.mcap"
        converted = join_logs([open_log(place / name) for name in ("a.ulg", "b.ubx")], target)
        return analysed(read_flight(target, converted))


@cache
def magnetic() -> FlightResults:
    """A figure of eight."""
    from tests.systems.magnetic.test_run import figure_eight

    return figure_eight()


@cache
def ground() -> FlightResults:
    """Ground runs on many headings."""
    from tests.systems.magnetic.test_ground import whole

    return whole()


@cache
def flux() -> FlightResults:
    """A compass that gives heading alone, on eight legs."""
    from tests.systems.magnetic.test_flux import whole

    return whole()


@cache
def landing() -> FlightResults:
    """Approaches by an ILS, the threshold given; its receiver tells protection levels."""
    from tests.systems.landing.test_tab import results

    found = results(True)
    path = found.rows_of(LandingPath)
    assert path is not None
    wave = 5.0 + np.sin(path.time_s)
    protection = LandingProtection(
        time_s=path.time_s,
        horizontal_protection_m=wave,
        horizontal_alarm_limit_m=np.full(len(path), 40.0),
        vertical_protection_m=2.0 * wave,
        vertical_alarm_limit_m=np.full(len(path), np.nan),
        approach=path.approach,
    )
    return replace(found, figures=(*found.figures, protection))


@cache
def landing_without_site() -> FlightResults:
    """Approaches by an ILS whose threshold is found."""
    from tests.systems.landing.test_tab import results

    return results(False)


@cache
def beacons() -> FlightResults:
    """An approach by locators."""
    from tests.systems.landing.example import approach_scenario
    from tests.systems.landing.test_beacons import analysed

    return of_answers(analysed(approach_scenario()).answer)


@cache
def ranges() -> FlightResults:
    """A landing by ranges as planned."""
    from tests.systems.planning.test_landing import FOUR

    return of_answers(*LANDING_PLAN.run(replace(FOUR, trials=12)).answers.values())


@cache
def control() -> FlightResults:
    """A planned session."""
    from tests.systems.planning.test_control import mixed

    planned = plan_session(mixed())
    return replace(of_answers(*planned.answers.values()), figures=figures_of(planned))


@cache
def placement() -> FlightResults:
    """Points placed for an approach, one area kept out."""
    from tests.systems.planning.test_placement import approach

    planned = plan_session(approach(keep_out=(LAKE,), iterations=10))
    return replace(of_answers(*planned.answers.values()), figures=figures_of(planned))


@cache
def session() -> FlightResults:
    """A session of three aircraft."""
    from tests.session_example import SHORT, simulated
    from tests.systems.cooperative.example import believed

    given = SessionKnown(settings={"cooperative": believed(SHORT)})
    return of_answers(*run_analyses((COOPERATIVE,), simulated(SHORT).session, given).answers.values())


@cache
def crowd() -> FlightResults:
    """A session of more aircraft than there are roles of a series."""
    from tests.session_example import SEED, SHORT
    from tests.systems.cooperative.example import believed

    aircraft = tuple(
        replace(SHORT.aircraft[0], name=f"V{number}", north_m=9000.0 * number, east_m=2000.0 * number**2, turns=())
        for number in range(8)
    )
    scenario = replace(SHORT, aircraft=aircraft, duration_s=5.0)
    given = SessionKnown(settings={"cooperative": believed(scenario)})
    return of_answers(*run_analyses((COOPERATIVE,), simulate_session(scenario, SEED).session, given).answers.values())


@cache
def trajectory() -> FlightResults:
    """A solution whose heading is ambiguous, beside a filter on board, with a gap of the unit."""
    from tests.systems.trajectory.made_answers import drawn

    return of_answers(drawn())


@cache
def at_rest() -> FlightResults:
    """An aircraft that did not move, in many modes, without a height on its approach."""
    results = landing()
    path = results.rows_of(LandingPath)
    assert path is not None
    count = 50
    time = np.linspace(0.0, 100.0, count)
    nowhere, zero = np.full(count, np.nan), np.zeros(count)
    course = Overview(
        time_s=time,
        latitude_deg=56.0 + 1e-7 * np.sin(time),
        longitude_deg=38.0 + 1e-7 * np.cos(time),
        altitude_m=nowhere,
        ground_speed_mps=zero,
        heading_deg=nowhere,
        track_deg=nowhere,
        climb_mps=zero,
        magnetic_heading_deg=np.linspace(350.0, 370.0, count) % 360.0,
    )
    modes = StateLanes(
        lane=np.array(["mode"] * 15 + ["landed"]),
        start_s=np.arange(16.0),
        end_s=np.arange(16.0) + 1.0,
        state=np.array([f"M{number}" for number in range(15)] + ["on the ground"]),
    )
    lost = GnssLanes(start_s=np.array([0.0, 9.0]), end_s=np.array([9.0, 99.0]), state=np.array(["good", "gdop > 2"]))
    without_height = replace_column(path, height_m=np.full(len(path), np.nan))
    return replace(results, figures=(course, modes, lost, without_height))


def replace_column(arrays: LandingPath, **columns: Any) -> LandingPath:
    """The arrays with some columns of other values."""
    return LandingPath.of(FigureData(arrays.name, {**arrays.columns, **columns}, {}))


def recorded(log: Path, folder: Path) -> FlightResults:
    """Results of all analyses of a recorded log."""
    target = folder / "flight.mcap"
    return analysed(read_flight(target, convert_log(open_log(log), target)))


def analysed(flight: Flight) -> FlightResults:
    """Results of all analyses of a flight."""
    source = Source("made.csv", "ab" * 32, 1, "flat-csv")
    given = Given("NOTIME_abababab", source, Ledger(), Clock(), (), has_lost_data=False)
    return analyse(flight, given, Configuration())


def of_answers(*answers: Answer) -> FlightResults:
    """Results that are nothing but some answers with their arrays."""
    figures = tuple(figure for answer in answers for figure in answer.figures)
    source = Source("made.csv", "ab" * 32, 1, "flat-csv")
    return FlightResults(
        *("NOTIME_abababab", source, {}, None, 600.0, "ok"), answers=by_analysis(*answers), figures=figures
    )


def figures_of(planned: Planned) -> tuple[FigureData, ...]:
    """Arrays of a plan and of its answers."""
    return (*planned.figures, *(figure for answer in planned.answers.values() for figure in answer.figures))


RECORDED = (
    "g1000/log_210623_141501_TEST1.csv",
    "g1000/log_220417_125002_LFQA.csv",
    "ulog/Proto_FLT09_REENCODED_fixedwing.ulg",
    "ulog/pyulog_sample.ulg",
    "ulog/quadrotor_local.ulg",
    "dataflash/plane_4.2.3_pilot0004.BIN",
    "dataflash/copter_3.6.7_log0041.BIN",
    "tlog/uavlogviewer_vtol.tlog",
    "inertial/gv_ff02.csv",
    "fixedwing/umn_thor_flight75.csv",
    "gnss/walk_0827_gnss_1730.ubx",
    "reference_heading/pntos_drive_first_half.csv",
)
CASES: dict[str, Callable[[], FlightResults]] = {
    "report": report,
    "viewer": viewer,
    "aided": aided,
    "bare": bare,
    "flown": flown,
    "joined": joined,
    "magnetic": magnetic,
    "ground": ground,
    "flux": flux,
    "landing": landing,
    "landing_without_site": landing_without_site,
    "beacons": beacons,
    "ranges": ranges,
    "control": control,
    "placement": placement,
    "session": session,
    "crowd": crowd,
    "trajectory": trajectory,
    "at_rest": at_rest,
    "units": several_units,
    "causes": by_cause,
}


def names_of(name: str, results: FlightResults) -> list[tuple[str, ...]]:
    """Of which a figure can be, where it is one of several alike."""
    if name == SERIES:
        known = (
            one
            for one in results.figure_names
            if not one.startswith(("causes_", "gnss_", "health_", "trajectory_", "units_"))  # whose chapters draw them
            and (found := results.figure_with_rows(one)) is not None
            and "time_s" in found.columns
            and columns_by_unit(found)
        )
        return [(one,) for one in list(known)[:MOST_GENERIC]]
    if name in ("units.errors", "units.pairs"):
        return [(quantity,) for quantity in ("radial", "velocity", "heading")]
    if name in ("inertial.state", "inertial.differences"):
        return [("position",), ("velocity",)]
    if name.startswith("landing."):
        answer = results.answer(LandingResult)
        return [(str(one.number),) for one in answer.approaches] if answer else [("1",)]
    if name == "reference.errors":
        reference = results.answer(ReferenceResult)
        subjects = sorted({row.subject for row in reference.errors}) if reference else ["gnss"]
        return [(f"{one} {what}",) for one in subjects for what in ("position", "velocity", "attitude")]
    if name == "together.motion":
        joined = results.answer(Together)
        return [(one.label,) for one in joined.agreement] if joined else [("b",)]
    if name == "health.panels":
        health = results.answer(AutopilotHealth)
        return [(one.key,) for one in health.checks] if health else [("gnss",)]
    if name in ("gnss.quality", "gnss.standstill", "gnss.steps", "gnss.pair"):
        reception = results.answer(GnssReception)
        if name == "gnss.pair":
            return [(f"{one.second} from {one.first}",) for one in reception.pairs] if reception else [("b from a",)]
        return [(one.topic,) for one in reception.receivers] if reception else [("gnss",)]
    return [()]
