"""Answer of landing by locators: rows at round distances, figure, claimed accuracy."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from groundstation.results.arrays.typed import joined
from groundstation.results.landing_categories import ACCURACY_ONLY, LINEAR_95, axis_category_met
from groundstation.systems.known import Beacon, Runway
from groundstation.systems.landing.arrays import BeaconsPath
from groundstation.systems.landing.beacons.answer import BeaconApproachRow, BeaconLanding, BeaconRow, DeviationRow
from groundstation.systems.landing.beacons.approach import WELL_KNOWN_M, Deviations, PlaceEvidence, Sampled
from groundstation.systems.landing.beacons.settings import LandingBeaconsSettings

DISTANCES_M = (5000.0, 3000.0, 2000.0, 1500.0, 750.0, 500.0, 320.0, 100.0, 0.0)
MEAN_S = 1.0  # a row is the mean over so long

Flown = tuple[Sampled, Deviations, PlaceEvidence]


def beacon_landing(
    runway: Runway, beacons: Sequence[Beacon], flown: Sequence[Flown], settings: LandingBeaconsSettings
) -> BeaconLanding:
    """Answer of all approaches that can be believed."""
    counts = sum(np.isfinite(part.bearings_deg).sum(axis=0) for part, _, _ in flown)
    return BeaconLanding(
        runway=runway.name,
        bearing_sigma_deg=settings.bearing_sigma_deg,
        height_sigma_m=settings.height_sigma_m,
        beacons=tuple(
            BeaconRow(one.name, one.before_threshold_m, one.right_m, int(count))
            for one, count in zip(beacons, counts, strict=True)
        ),
        approaches=tuple(_approach(number, *one) for number, one in enumerate(flown, start=1)),
        rows=tuple(row for number, one in enumerate(flown, start=1) for row in _rows(number, one)),
        remarks=(ACCURACY_ONLY,),
        settings=asdict(settings),
        figures=(_figure(flown),),
    )


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _approach(number: int, part: Sampled, found: Deviations, told: PlaceEvidence) -> BeaconApproachRow:
    before = found.before_m[found.found & (found.distance_sigma_m < WELL_KNOWN_M)]
    return BeaconApproachRow(
        approach=number,
        start_s=float(part.time_s[0]),
        end_s=float(part.time_s[-1]),
        first_before_threshold_m=float(before[0]),
        last_before_threshold_m=float(before[-1]),
        fixes=int(found.found.sum()),
        blind=int((~found.found).sum()),
        speed_mps=told.speed_mps,
        ground_speed_mps=_known(told.ground_speed_mps),
        heading_difference_deg=_known(told.heading_difference_deg),
        terrain_m=_known(told.terrain_m),
    )


def _rows(number: int, flown: Flown) -> list[DeviationRow]:
    """Return rows at round distances before the threshold.

    Each holds means over a second about the time at which the straight flight is there.
    """
    part, found, told = flown
    rows = []
    for distance_m in DISTANCES_M:
        there_s = told.threshold_s - distance_m / told.speed_mps
        near = found.found & (np.abs(part.time_s - there_s) <= 0.5 * MEAN_S)
        if not near.any():
            continue
        lateral, glide, along = (
            LINEAR_95 * float(np.median(sigma[near]))
            for sigma in (found.lateral_sigma_m, found.glide_path_sigma_m, found.distance_sigma_m)
        )
        above = found.glide_path_m[near & np.isfinite(found.glide_path_m)]
        met = axis_category_met(lateral, "horizontal"), axis_category_met(glide, "vertical") if len(above) else None
        rows.append(
            DeviationRow(
                number,
                distance_m,
                along,
                float(np.mean(found.fix.right_m[near])),
                lateral,
                float(np.mean(above)) if len(above) else None,
                glide if len(above) else None,
                *(one.name if one else "" for one in met),
            )
        )
    return rows


def _figure(flown: Sequence[Flown]) -> BeaconsPath:
    parts = []
    for number, (part, found, told) in enumerate(flown, start=1):
        parts.append(
            BeaconsPath(
                time_s=part.time_s,
                approach=np.full(len(part.time_s), number),
                straight_before_threshold_m=told.speed_mps * (told.threshold_s - part.time_s),
                before_threshold_m=found.before_m,
                distance_sigma_m=found.distance_sigma_m,
                lateral_m=found.fix.right_m,
                lateral_sigma_m=found.lateral_sigma_m,
                glide_path_m=found.glide_path_m,
                glide_path_sigma_m=found.glide_path_sigma_m,
                height_m=part.height_m,
                off_course_deg=found.fix.off_course_deg,
            )
        )
    return joined(parts)
