"""Acceptance of the INS from a folder of flights, judged against a standard.

It is made from what the flights saved; page and tables are written.
"""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.quantiles import NORMAL_95, length_quantile
from groundstation.base.shipped_toml import ShippedToml, TomlFile
from groundstation.base.toml_settings import settings_from
from groundstation.base.units import M_PER_NAUTICAL_MILE
from groundstation.base.version import __version__
from groundstation.methods.fleet.acceptance import (
    accuracy_ratio,
    curves_figure,
    decision_of,
    growth_figure,
    ins_rows,
    judgements,
)
from groundstation.methods.fleet.ins_errors import PositionErrors, growth_of, ins_errors
from groundstation.pipeline.many_flights.inputs import saved_flights
from groundstation.pipeline.one_flight.identity import safe_part
from groundstation.reports.acceptance import write_acceptance_report
from groundstation.results.acceptance import QUANTITIES, UNKNOWN_INS, Acceptance, FlightError, Standard
from groundstation.results.arrays.typed import MissingColumnError
from groundstation.results.figures import FigureData
from groundstation.results.files import SavedFlight, csv_text, json_text, load, mapping, write_text
from groundstation.systems import systems
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.arrays import InertialStates, InertialTrack
from groundstation.systems.inertial.units_answer import InsUnit, UnitsResult
from groundstation.systems.inertial.units_arrays import UnitsErrors

STANDARDS = ShippedToml("groundstation.methods.fleet", "standards", "standard")
STATES, TRACK = "inertial_states", "inertial_track"
NOT_STATED = "not stated"
SERIAL_CHANGES = "its serial changes in flight: the errors of two INS"
RESET, REALIGNED = "inertial.ins_reset", "inertial.realigned"


def read_standard(name_or_path: str) -> tuple[Standard, TomlFile]:
    """Read a shipped standard by its name, or one of the user's by its path.

    Raises
    ------
    SettingsError
        For an unknown name or a file with a value that cannot be used.
    """
    file = STANDARDS.read(name_or_path)
    return settings_from(Standard, file.table, file.where), file


def accept(out: Path, standard: str) -> Acceptance:
    """Hold the flights of a folder against a standard, from what they saved alone.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made.
    SettingsError
        For a standard that cannot be used.
    """
    limits, file = read_standard(standard)
    folders = saved_flights(out)
    found = _without_twins([one for folder in folders for one in _units_of(folder, limits)])
    flights = [flight for flight, _, _ in found]
    kept = [(flight, errors) for flight, errors, _ in found if flight.is_included and errors is not None]
    included, errors = [flight for flight, _ in kept], [one for _, one in kept]
    growth = growth_of(errors)
    judged = judgements(included, limits)
    return Acceptance(
        file.name,
        limits,
        hashlib.sha256(file.text.encode("utf-8")).hexdigest(),
        __version__,
        decision_of(judged),
        tuple(flights),
        ins_rows(included, growth),
        judged,
        growth_figure(growth, included, limits),
        curves_figure(errors),
        _distinct(settings for flight, _, settings in found if flight.is_included),
    )


def accept_to(out: Path, standard: str, folder: Path | None = None) -> tuple[Acceptance, list[Path], str]:
    """Write an acceptance: page, PDF, JSON and the table of flights.

    ``folder`` left out, they stand beside the flights.

    Returns
    -------
    Acceptance, list of Path, str
        What was found, what was written, and why there is no PDF.

    Raises
    ------
    UsageError, SettingsError
        As :func:`accept`; when ``folder`` is a file.
    """
    target = out if folder is None else folder
    if target.exists() and not target.is_dir():
        raise UsageError(str(target), "a file", "a folder for the acceptance")
    found = accept(out, standard)
    target.mkdir(parents=True, exist_ok=True)
    stem = f"acceptance_{safe_part(found.name) or 'standard'}"
    written = write_acceptance_report(target / f"{stem}.html", found)
    write_text(target / f"{stem}.json", json_text(found.to_dict()))
    write_text(target / f"{stem}.csv", csv_text(flights_figure(found)))
    paths = [*written.paths, target / f"{stem}.json", target / f"{stem}.csv"]
    return found, paths, written.problem


def flights_figure(found: Acceptance) -> FigureData:
    """The table of flights with every figure that a limit may bound."""
    columns: dict[str, Any] = {
        name: np.array([str(getattr(flight, name) or "") for flight in found.flights], dtype=np.str_)
        for name in ("flight_id", "ins", "aircraft", "alignment", "source", "sha256", "reason")
    }
    columns["hours"] = np.array([flight.hours for flight in found.flights])
    columns |= {
        name: np.array([flight.values.get(name, np.nan) for flight in found.flights], dtype=np.float64)
        for name in QUANTITIES
    }
    return FigureData("flights", columns, {"hours": 4})


def _units_of(folder: Path, standard: Standard) -> list["Found"]:
    """Errors of each INS of one flight, or why it is left out.

    With them come the settings that its errors were found with.
    """
    try:
        saved = load(folder, systems().answer_types)
        return [_errors_of(saved, standard), *_errors_of_others(saved, standard)]
    except GroundstationError as error:
        reason = f"cannot be read: {error}"
        return [(FlightError(folder.name, "", "", "", None, "", "", "", reason, is_read=False), None, {})]


def _errors_of_others(saved: SavedFlight, standard: Standard) -> list["Found"]:
    """Errors of the INS of a flight beside the one of the chapter on INS errors.

    Not of the filters of an autopilot, which GNSS corrects.
    """
    units, inertial = saved.results.answer(UnitsResult), saved.results.answer(InertialResult)
    if units is None or inertial is None:
        return []
    others = [
        one for one in units.units if one.topic != inertial.ins_topic and (one.kind != "gnss_aided" or one.serials)
    ]
    return [_errors_of_unit(saved, units, one, inertial, standard) for one in others]


def _errors_of_unit(
    saved: SavedFlight, units: UnitsResult, unit: InsUnit, inertial: InertialResult, standard: Standard
) -> "Found":
    flight = replace(_named(saved, unit.topic), ins=_unit_of(saved, unit.topic))
    reason = _unit_not_judged(units, unit)
    try:
        rows = saved.rows_of(UnitsErrors)
    except MissingColumnError:
        rows = None
    if not reason and rows is None:
        reason = "its arrays are of an older version: run the log again"
    if reason or rows is None or unit.start_s is None:
        return replace(flight, reason=reason), None, {}
    mine = rows.where(rows.unit == unit.topic)
    errors = ins_errors(
        *(mine.time_s, mine.north_m, mine.east_m, mine.latitude_deg, mine.longitude_deg), start_s=unit.start_s
    )
    if errors is None or np.ptp(errors.hours) * 60.0 < standard.minutes_min:
        return replace(flight, reason=f"less than {standard.minutes_min:g} min of navigation compared"), None, {}
    hours = float(errors.hours[-1])
    velocity = unit.velocity_rms_mps
    flight = replace(
        flight,
        hours=hours,
        epochs=len(errors.hours),
        values=errors.values() | ({} if velocity is None else {"velocity_error_rms_mps": velocity.value}),
        reference95=_reference95(inertial, None, hours),
    )
    return _sure_enough(flight, standard), errors, inertial.settings | {"ins_class": units.ins_class}


def _unit_not_judged(units: UnitsResult, unit: InsUnit) -> str:
    """Reason why another INS of a flight does not count; empty where it does."""
    if unit.same_as:
        return f"it repeats {unit.same_as}"
    if len(unit.serials) > 1:
        return SERIAL_CHANGES
    if not unit.has_position:
        return "it logs no position"
    if unit.kind != "unaided":
        return "GNSS corrects it" if unit.kind == "gnss_aided" else "GNSS may correct it"
    if any(one.kind == "step" and one.topics == (unit.topic,) and one.unit == "m" for one in units.faults):
        return "the position of the INS was set in flight"
    if any(one.kind == "frozen" and one.topics == (unit.topic,) for one in units.faults):
        return "its outputs stood still in flight"
    return "" if unit.start_s is not None else "nothing shows when navigation began"


def _errors_of(saved: SavedFlight, standard: Standard) -> tuple[FlightError, PositionErrors | None, Mapping[str, Any]]:
    results, inertial = saved.results, saved.results.answer(InertialResult)
    flight = _named(saved, inertial.ins_topic if inertial else "")
    reason = _not_judged(saved, inertial)
    units = results.answer(UnitsResult)
    if not reason and units is not None and inertial is not None:
        changed = [one for one in units.units if one.topic == inertial.ins_topic and len(one.serials) > 1]
        reason = SERIAL_CHANGES if changed else ""
    start = None if inertial is None or reason else inertial.navigation_start
    if inertial is None or start is None or start.time_s is None:
        return replace(flight, reason=reason), None, {}
    states, track = _rows_of(saved)
    if states is None or track is None or len(states) != len(track):
        return replace(flight, reason="its arrays are of an older version: run the log again"), None, {}
    errors = ins_errors(
        states.time_s,
        states.north.measured_position_m,
        states.east.measured_position_m,
        track.ins_latitude_deg,
        track.ins_longitude_deg,
        start_s=start.time_s,
    )
    if errors is None or np.ptp(errors.hours) * 60.0 < standard.minutes_min:
        return replace(flight, reason=f"less than {standard.minutes_min:g} min of navigation compared"), None, {}
    heading = results.answer(HeadingResult)
    flight = replace(
        flight,
        hours=float(errors.hours[-1]),
        epochs=inertial.epochs,
        values=errors.values() | _other_values(inertial, heading),
    )
    flight = replace(flight, reference95=_reference95(inertial, heading, flight.hours))
    return _sure_enough(flight, standard), errors, inertial.settings | {"ins_class": inertial.ins_class}


def _named(saved: SavedFlight, topic: str) -> FlightError:
    results = saved.results
    return FlightError(
        saved.folder.name,
        _unit_of(saved, topic),
        results.metadata.get("aircraft", ""),
        _said(saved, "ins_alignment") or NOT_STATED,
        results.start_utc_ns,
        results.source.name,
        results.source.sha256,
        saved.manifest.groundstation,
    )


def _rows_of(saved: SavedFlight) -> tuple[InertialStates | None, InertialTrack | None]:
    """Arrays of a flight that is judged; None where they are of an older version."""
    try:
        return saved.rows_of(InertialStates), saved.rows_of(InertialTrack)
    except MissingColumnError:
        return None, None


def _not_judged(saved: SavedFlight, inertial: InertialResult | None) -> str:
    """Reason why a flight is no free inertial one that can be judged; empty where it is."""
    if inertial is None:
        return "; ".join(saved.results.reasons(InertialResult.analysis)) or "no INS errors found"
    if inertial.kind != "unaided":
        return "GNSS corrects its INS" if inertial.kind == "gnss_aided" else "GNSS may correct its INS"
    codes = {finding.code for finding in saved.results.findings}
    if RESET in codes:
        return "the position of the INS was set in flight"
    if REALIGNED in codes:
        return "the INS was aligned again in flight"
    if inertial.navigation_start is None:
        return "saved by an older version, which did not ask when navigation began: run the log again"
    if inertial.navigation_start.time_s is None:
        return f"nothing shows when navigation began: {inertial.navigation_start.reason}"
    return ""


def _other_values(inertial: InertialResult, heading: HeadingResult | None) -> dict[str, float]:
    values = {}
    if inertial.velocity_error_rms_mps is not None:
        values["velocity_error_rms_mps"] = inertial.velocity_error_rms_mps
    if heading is not None and heading.verdict != "reject":
        values["heading_error_deg"] = heading.error_deg
    return values


def _reference95(inertial: InertialResult, heading: HeadingResult | None, hours: float) -> dict[str, float]:
    """Error of the reference in 95 % of cases, in the units of the figures that it judges.

    Of GNSS what the estimator took it for: white and correlated noise of either axis.
    """

    def radial95(quantity: str, unit: str) -> float | None:
        parts = [inertial.settings.get(f"noise.gnss.{quantity}_{kind}_{unit}") for kind in ("white", "correlated")]
        sigmas = [float(part) for part in parts if isinstance(part, int | float)]
        sigma = math.hypot(*sigmas) if len(sigmas) == 2 else 0.0
        return length_quantile(0.95, 0.0, sigma) if sigma > 0.0 else None

    found: dict[str, float] = {}
    position, velocity = radial95("position", "m"), radial95("velocity", "mps")
    if position is not None:
        nmi = position / M_PER_NAUTICAL_MILE
        names = ("radial_final_nmi", "radial_largest_nmi", "along_largest_nmi", "cross_largest_nmi")
        found |= dict.fromkeys(names, nmi)
        found |= dict.fromkeys(("radial_rate_fit_nmiph", "radial_rate_final_nmiph"), nmi / hours)
    if velocity is not None:
        found["velocity_error_rms_mps"] = velocity
    if heading is not None:
        found["heading_error_deg"] = NORMAL_95 * heading.standard_error_deg
    return found


def _sure_enough(flight: FlightError, standard: Standard) -> FlightError:
    """Flight, left out where the reference is not surer than a limit by the ratio asked for."""
    least = standard.accuracy_ratio_min
    ratios = [accuracy_ratio(flight, limit) for limit in standard.limits if limit.is_for(flight.hours)]
    known = [ratio for ratio in ratios if ratio is not None]
    if least is None or (known and min(known) >= least):
        return flight
    told = f"{min(known):.1f}" if known else "unknown"
    return replace(flight, reason=f"accuracy ratio of the reference {told}, {least:g} needed")


def _unit_of(saved: SavedFlight, topic: str) -> str:
    """Name of the INS: its serial, else the aircraft and the topic.

    Where neither is known it may be any.
    """
    units = saved.results.answer(UnitsResult)
    known = {} if units is None else {one.topic: one.serials for one in units.units}
    if known.get(topic):
        return known[topic][0]
    serial = _said(saved, "ins_serial") if topic not in known else ""
    if serial:
        return serial
    aircraft = saved.results.metadata.get("aircraft", "")
    return f"{aircraft} {topic}".strip() if aircraft else UNKNOWN_INS


def _said(saved: SavedFlight, key: str) -> str:
    """Value that the aircraft file of the run says, else the head of the log."""
    set_by_user = mapping(saved.manifest.configuration, "aircraft").get(key)
    return str(set_by_user or saved.results.metadata.get(key, "")).strip()


Found = tuple[FlightError, PositionErrors | None, Mapping[str, Any]]


def _without_twins(found: list[Found]) -> list[Found]:
    """The same with a second flight of one log left out; its INS are of one flight."""
    first: dict[str, str] = {}
    kept: list[Found] = []
    for flight, errors, settings in found:
        if flight.is_included and first.get(flight.sha256, flight.flight_id) != flight.flight_id:
            kept.append((replace(flight, reason=f"the same log as {first[flight.sha256]}"), None, settings))
            continue
        if flight.is_included:
            first[flight.sha256] = flight.flight_id
        kept.append((flight, errors, settings))
    return kept


def _distinct(every: Any) -> dict[str, tuple[str, ...]]:
    """The values of each setting over the flights, in order."""
    seen: dict[str, set[str]] = {}
    for settings in every:
        for name, value in settings.items():
            seen.setdefault(name, set()).add(f"{value:.10g}" if isinstance(value, float) else str(value))
    return {name: tuple(sorted(values)) for name, values in sorted(seen.items())}
