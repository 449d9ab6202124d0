"""Cases of the forecast study: how the truth is made, and what the filter believes of it."""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import MPS2_PER_G
from groundstation.methods.ins_noise import GnssNoise, InsNoise, load_class
from groundstation.simulation.channel_truth import RADIUS_M
from groundstation.simulation.inertial_family import ORDINARY_RECEIVER, ErrorBatch, FamilySettings
from groundstation.simulation.inertial_family import GnssErrorModel as SimulatedGnss
from groundstation.simulation.ins_class import InsClass, load_ins_class
from groundstation.simulation.routes import RouteKind
from groundstation.systems.inertial.differences import InsDifferences, drag_per_s
from groundstation.systems.inertial.filter import STANDARD_GATE, DifferenceEpochs
from groundstation.systems.inertial.model import ChannelModel

FIRST_SEED = 50_000  # no smaller seed belongs to a study: those below were used for tuning the classes
SEEDS_PER_STUDY = 10
WHITE_M = 10.0
COLOURED_M, COLOURED_S, TAKEN_FOR_M = 10.0, 300.0, 3.0
WALKS_DPH_PER_SQRT_H = (0.03, 0.1)  # three and ten times the constant drift of the class, within an hour
NO_GATE = 1e12
NEW_ROUTES: dict[str, RouteKind] = {
    "own_straight": "straight",
    "out_and_back": "out_and_back",
    "dogleg": "dogleg",
    "racetrack": "racetrack",
    "late_survey": "late_survey",
}


@dataclass(frozen=True)
class FilterCase:
    """One truth and one filter.

    Parameters
    ----------
    name, title : str
    family : FamilySettings
        Cases of one family and seed are filtered on the same flights.
    seed : int
    noise : InsNoise
        What the filter believes.
    gate : float
        Of the filter, squared sigmas. The paper's filter has none.
    uses_velocity : bool
        Whether the velocity difference is measured beside the position difference.
    is_misled : bool
        Whether the filter is told something false on purpose.
    is_calibrated : bool
        Whether the study looks at the sigma of the forecasts, too.
    is_held_out : bool
        Whether the flights stand for real ones, on which the methods are compared for good.
    is_new : bool
        Whether nothing was tuned on flights of its route; fewer of them are flown (docs/evidence/forecast.md).
    """

    name: str
    title: str
    family: FamilySettings
    seed: int
    noise: InsNoise
    gate: float = STANDARD_GATE
    uses_velocity: bool = False
    is_misled: bool = False
    is_calibrated: bool = False
    is_held_out: bool = False
    is_new: bool = False


def study_cases(seed: int) -> tuple[FilterCase, ...]:
    """Return all cases of a study; their seeds grow from ``FIRST_SEED``.

    None of the seeds was used for tuning.

    Examples
    --------
    >>> [case.name for case in study_cases(0)]
    ['matched', 'coloured', 'gated', 'inflated', 'walk', 'larger_walk', 'i21', 'straight', 'manoeuvring',
    'own_straight', 'out_and_back', 'dogleg', 'racetrack', 'late_survey']
    """
    first = FIRST_SEED + SEEDS_PER_STUDY * seed
    ins = load_ins_class("i-21")
    white = FamilySettings(ins=ins, truth="channel", gnss=SimulatedGnss(position_white_m=WHITE_M))
    coloured = replace(white, gnss=SimulatedGnss(TAKEN_FOR_M, COLOURED_M, COLOURED_S))
    matched = matched_noise(ins, GnssNoise(WHITE_M, 0.0, 0.0, is_inflated=False))
    naive = replace(matched, gnss=GnssNoise(TAKEN_FOR_M, 0.0, 0.0, is_inflated=False))
    inflated = replace(matched, gnss=GnssNoise(TAKEN_FOR_M, COLOURED_M, COLOURED_S))
    walks = [replace(matched, drift_walk_dph_per_sqrt_h=walk) for walk in WALKS_DPH_PER_SQRT_H]
    title = f"GNSS error of {COLOURED_M:g} m over {COLOURED_S:g} s"
    taken, walked = f"{title} taken for white {TAKEN_FOR_M:g} m", "drift taken for a walk of"
    gate, second = f"innovations gated at {STANDARD_GATE**0.5:g} sigma", first + 1
    simple = (
        FilterCase("matched", "the model is exactly true", white, first, matched, is_calibrated=True),
        FilterCase("coloured", f"{taken}, no gate", coloured, second, naive, NO_GATE, is_misled=True),
        FilterCase("gated", f"the same, {gate}", coloured, second, naive, is_misled=True),
        FilterCase("inflated", f"{title}, R inflated honestly", coloured, second, inflated),
        *(
            FilterCase(
                name,
                f"{walked} {noise.drift_walk_dph_per_sqrt_h:g} deg/h per sqrt(h)",
                white,
                first,
                noise,
                is_misled=True,
            )
            for name, noise in zip(("walk", "larger_walk"), walks, strict=True)
        ),
    )
    return (
        *simple,
        full_case("i21", "full truth, I-21 class, Norilsk to Moscow", "i-21", "norilsk_moscow", first + 2),
        full_case("straight", "full truth, navigation grade, straight", "navigation", "straight", first + 3),
        full_case("manoeuvring", "full truth, navigation grade, manoeuvring", "navigation", "manoeuvring", first + 4),
        *(own_case(name, route, first + place) for place, (name, route) in enumerate(NEW_ROUTES.items(), start=5)),
    )


def full_case(name: str, title: str, ins_class: str, route: RouteKind, seed: int) -> FilterCase:
    """Return a case of full truth, filtered with the noise of its class as shipped."""
    family = FamilySettings(ins=ins_class, route=route, gnss=ORDINARY_RECEIVER)
    noise = load_class(ins_class)
    return FilterCase(name, title, family, seed, noise, uses_velocity=True, is_calibrated=True, is_held_out=True)


def own_case(name: str, route: RouteKind, seed: int) -> FilterCase:
    """Return a case of a route nothing was tuned on, each flight with its own instrument."""
    title = f"navigation grade, {route.replace('_', ' ')}, each flight its own instrument"
    case = full_case(name, title, "navigation", route, seed)
    return replace(case, family=replace(case.family, each_its_own=True), is_new=True)


def differences_of(batch: ErrorBatch, row: int, epochs: DifferenceEpochs) -> InsDifferences:
    """Return epochs of one simulated flight with the motion of its INS."""
    velocity = np.stack([batch.velocity_north_mps[row], batch.velocity_east_mps[row]], axis=1)
    place = (batch.latitude_deg[row], batch.longitude_deg[row], batch.altitude_m[row])
    return InsDifferences("ins", "gnss", epochs, *place, velocity, 0.0, (), batch.heading_deg[row])


def matched_noise(ins: InsClass, gnss: GnssNoise) -> InsNoise:
    """Return the filter's noise for which channel truth of a class is exactly true."""
    return InsNoise(
        name=f"{ins.name}, matched",
        position_m=ins.initial_position_m,
        velocity_mps=ins.initial_velocity_mps,
        tilt_rad=ins.initial_tilt_rad,
        drift_dph=ins.gyro_constant_dph,
        drift_rate_dphph=ins.gyro_trend_dph_per_h,
        random_drift_dph=ins.gyro_random_dph,
        random_drift_correlation_s=ins.gyro_correlation_s,
        velocity_walk_mps_per_sqrt_s=ins.velocity_random_walk_mps_per_sqrt_s,
        tilt_walk_deg_per_sqrt_h=ins.angle_random_walk_deg_per_sqrt_h,
        gnss=gnss,
    )


def epochs_of(case: FilterCase, batch: ErrorBatch, row: int) -> DifferenceEpochs:
    """Return the filter's input of one simulated flight: INS minus GNSS at every epoch."""
    position = batch.position_error_m[row] - batch.gnss_position_error_m[row]
    velocity = batch.velocity_error_mps[row] - batch.gnss_velocity_error_mps[row]
    if not case.uses_velocity:
        velocity = np.full_like(velocity, np.nan)
    if case.family.truth == "channel":
        return DifferenceEpochs.plain(batch.time_s, position, velocity)
    ground = np.stack([batch.velocity_north_mps[row], batch.velocity_east_mps[row]], axis=1)
    drag = drag_per_s(batch.latitude_deg[row], batch.altitude_m[row], ground)
    return DifferenceEpochs(batch.time_s, position, velocity, drag, np.zeros(len(batch.time_s), dtype=bool))


def model_of(case: FilterCase, batch: ErrorBatch, row: int) -> ChannelModel:
    """Return the channel model of a flight.

    Gravity and radius are the truth's own, or those of the flight's mean place.
    """
    if case.family.truth == "channel":
        return ChannelModel(MPS2_PER_G, RADIUS_M, case.noise.beta_per_s)
    place: tuple[FloatArray, FloatArray] = (batch.latitude_deg[row], batch.altitude_m[row])
    return ChannelModel.at(float(np.mean(place[0])), float(np.mean(place[1])), case.noise.beta_per_s)
