"""Share of a flight in the fleet that heading adds: its samples, and checks of its error."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.results.files import SavedFlight
from groundstation.results.fleet_share import Check, FleetSamples, SystemShare, check_of, to_number
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.arrays import HeadingSamples
from groundstation.systems.heading.figures import IN_PAUSE
from groundstation.systems.heading.references import REFERENCE_SIGMA_DEG, logged_reference
from groundstation.systems.system import InFleet


def share_of(saved: SavedFlight) -> SystemShare:
    """Return what a flight adds to the fleet.

    Raises
    ------
    UnreadableLogError
        When the file of its samples is broken.
    """
    return SystemShare(samples=heading_samples(saved), checks=_checks(saved))


def heading_samples(saved: SavedFlight) -> FleetSamples | None:
    """The heading samples a flight saved, None when it has none.

    Raises
    ------
    UnreadableLogError
        When their file is broken.
    """
    figure = saved.rows_of(HeadingSamples)
    if figure is None:
        return None
    epochs = figure.where(figure.gate != IN_PAUSE)
    difference, used = epochs.difference_deg, epochs.is_used
    heading = saved.results.answer(HeadingResult)
    centre = float(np.nan_to_num(wrap_180(to_number(heading.error_deg if heading else None))))
    columns: dict[str, NDArray[Any]] = {
        "time_s": epochs.time_s,
        "segment": epochs.segment.astype(np.float64),
        "heading_deg": epochs.heading_deg,
        "track_deg": epochs.track_deg,
        "ground_speed_mps": epochs.ground_speed_mps,
        "weight": epochs.weight,
        "error_deg": difference,
        "used": used,
        "gate": epochs.gate,
    }
    return FleetSamples(columns, centre + wrap_180(difference[used] - centre))


def _checks(saved: SavedFlight) -> list[Check]:
    """Everything independent that the heading error was compared with."""
    heading = saved.results.answer(HeadingResult)
    if heading is None:
        return []
    verdict = heading.verdict
    found = [_reference_check(heading, saved.results.metadata)]
    found += [check_of("runway", runway.difference_deg, runway.sigma_deg, verdict) for runway in heading.runway]
    if heading.onboard is not None:
        # Steady sideslip is the same in both.
        difference = heading.onboard.difference_error_deg
        found.append(check_of("onboard", difference, heading.measured_sigma_deg, verdict))
    return [check for check in found if check is not None]


def _reference_check(heading: HeadingResult, metadata: Mapping[str, str]) -> Check | None:
    reference, residual = logged_reference(metadata), heading.reference_residual_arcmin
    sigma = math.hypot(to_number(heading.parking_sigma_deg), reference.sigma_deg if reference else REFERENCE_SIGMA_DEG)
    return check_of("reference", None if residual is None else residual / ARCMIN_PER_DEG, sigma, heading.verdict)


IN_FLEET = InFleet(share=share_of)
