"""Mounting of an inertial unit: how its case stands to the body's forward, right, down.

Stated in the aircraft file, or known from the log of an autopilot that turns its samples itself, else the turn of the
axes that gravity and the direction of travel show; else the attitude is that of the case. Before any of them is
believed the unit is held against GNSS: mirrored or swapped axes, wrong units, a stuck axis or a unit of another vehicle
are refused.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.base.words import counted
from groundstation.systems.trajectory.axis_hypotheses import Explanation, ranked, relation_of
from groundstation.systems.trajectory.axis_turns import (
    angle_between_deg,
    angles_of,
    axes_told,
    axis_turns,
    from_angles,
)
from groundstation.systems.trajectory.fix_checks import wrong_velocity
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements
from groundstation.systems.trajectory.mounting_looks import (
    Correlations,
    Direction,
    Looks,
    correlations,
    flies_nose_first,
    gravity_of,
    has_real_motion,
    looks_of,
    measured_turn,
)
from groundstation.systems.trajectory.mounting_settings import MountingSettings
from groundstation.systems.trajectory.short_spans import (
    Spans,
    Steps,
    Sums,
    resting_rate_radps,
    spans_of,
    steps_of,
)
from groundstation.systems.trajectory.unit_checks import wrong_force
from groundstation.tables.vehicle import VehicleKind

Source = Literal["stated", "logged", "found", "case", "refused"]
LEAST_CORRELATION = 0.5  # of the looks at what rolls
ON_WHEELS = 0.7  # likewise, of a vehicle of unknown kind; a bank leaves no force to the side
SHIPPED = MountingSettings()
UNRELATED = "its motion is not that of GNSS: a unit of another vehicle, or of another time"
MIRRORED = "its axes are left-handed: one is turned round, or two are swapped"
REVERSED = "its accelerometers have the signs of gravity, not of specific force, or its axes and rates are left-handed"
OTHER_AXES = "its gyros turn about other axes, or the other way, than its accelerometers show"
NOT_SHOWN = "; this motion does not show the sign of every axis"
IN_DEGREES = "its rates are degrees taken for radians: 57 times too large"
IN_RADIANS = "its rates are radians taken for degrees: 57 times too small"


@dataclass(frozen=True)
class LoggedMounting:
    """Mounting that the log of an autopilot tells.

    Parameters
    ----------
    body_from_case : ndarray, shape (3, 3)
        Of the logged samples' axes.
    words : str
    """

    body_from_case: FloatArray
    words: str


@dataclass(frozen=True)
class MountingEvidence:
    """Numbers behind a mounting; NaN or 0 where nothing shows them.

    Parameters
    ----------
    spans : int
        Spans of dead reckoning with enough motion.
    margin, margin_of_others : float
        Log-likelihood of a sound unit over the best unsound explanation, and over other times of GNSS.
    unexplained, misfit_mps : float
        Share of the squared changes of velocity of GNSS that a sound unit leaves unexplained, and their RMS.
    lag_s : float
        GNSS later than the unit, to the step that was tried.
    gravity_concentration, travel_concentration : float
        Length of the mean of unit vectors of gravity and of travel in the case.
    travel_steps : int
    along, across, turning, turning_ratio : float
        See :class:`Correlations`.
    measured_deg : ndarray, shape (3,)
        Roll, pitch, yaw of the case to the body, as gravity and travel show them.
    off_square_deg, next_turn_deg : float
        Angle from there to the nearest axis turn, and to the next one.
    """

    spans: int = 0
    margin: float = np.nan
    margin_of_others: float = np.nan
    unexplained: float = np.nan
    misfit_mps: float = np.nan
    lag_s: float = np.nan
    gravity_concentration: float = np.nan
    travel_concentration: float = np.nan
    travel_steps: int = 0
    along: float = np.nan
    across: float = np.nan
    turning: float = np.nan
    turning_ratio: float = np.nan
    measured_deg: FloatArray | None = None
    off_square_deg: float = np.nan
    next_turn_deg: float = np.nan


@dataclass(frozen=True)
class Mounting:
    """Mounting of the case, or why the unit is refused.

    Parameters
    ----------
    source : {'stated', 'logged', 'found', 'case', 'refused'}
        ``case``: not known, the attitude is that of the case.
    body_from_case : ndarray, shape (3, 3)
        Turns vectors in the axes of the case into forward, right, down; the identity where not known.
    words : str
        One line for people.
    evidence : MountingEvidence
    refused, doubt : str
        Why the unit is refused; what speaks against it, or against a mounting that was told. Empty without.
    """

    source: Source
    body_from_case: FloatArray
    words: str
    evidence: MountingEvidence = MountingEvidence()
    refused: str = ""
    doubt: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_from_case", frozen(np.asarray(self.body_from_case, dtype=np.float64)))


@dataclass(frozen=True)
class _Motion:
    """Motion of a log as both see it, and the explanations of it."""

    steps: Steps
    spans: Spans
    sums: Sums
    sound: Explanation
    evidence: MountingEvidence
    doubt: str


def find_mounting(
    imu: ImuIncrements,
    gnss: GnssFixes,
    *,
    vehicle: VehicleKind | None,
    stated: tuple[float, float, float] | None = None,
    logged: LoggedMounting | None = None,
    settings: MountingSettings = SHIPPED,
) -> Mounting:
    """Return the mounting of a unit.

    Parameters
    ----------
    imu, gnss
        In the axes of the case; of the same vehicle, which is held against them.
    vehicle : {'rolls', 'flies', 'walks', 'floats'}, optional
        What rolls goes forward; what flies does if it turns its nose with its track and never stops.
    stated : three floats, optional
        Roll, pitch and yaw of the case to the body, degrees.
    logged : LoggedMounting, optional

    Notes
    -----
    The axes of the gyros are proven only as far as the motion turns about them: a car proves the one that points down.
    """
    if len(imu) < 3:
        return _refused("too few samples of the unit", MountingEvidence())
    steps = steps_of(imu, gnss, settings)
    reason = wrong_velocity(gnss) or wrong_force(steps, settings)
    if reason:
        return _refused(reason, MountingEvidence())
    motion = _motion(imu, steps, settings)
    if isinstance(motion, Mounting):
        return motion
    mounting = _found(motion, steps, vehicle, settings)
    if stated is not None:
        mounting = _stated(mounting, stated, settings)
    elif logged is not None:
        mounting = _logged(mounting, logged, settings)
    if mounting.refused or not isinstance(motion, _Motion):
        return mounting
    if motion.doubt:
        return replace(mounting, doubt="; ".join(one for one in (mounting.doubt, f"maybe {motion.doubt}") if one))
    if motion.evidence.margin < settings.margin_doubt:
        return replace(mounting, words=mounting.words + NOT_SHOWN)
    return mounting


def _motion(imu: ImuIncrements, steps: Steps, settings: MountingSettings) -> _Motion | Mounting | MountingEvidence:
    """Hold the unit against GNSS.

    A refusal, the evidence where there is too little motion, else the motion.
    """
    sums = Sums(imu, resting_rate_radps(steps))
    spans = spans_of(steps, sums, settings)
    if len(spans) < settings.spans_min:
        return MountingEvidence(len(spans))
    every = tuple(one for one in ranked(spans, sums, settings) if not _is_hidden(one, steps, spans, settings))
    sound = next(one for one in every if one.is_sound)
    rival = next(one for one in every if not one.is_sound)
    relation = relation_of(spans, sums, settings, sound)
    margin = sound.log_likelihood - rival.log_likelihood
    evidence = MountingEvidence(
        len(spans), margin, relation.over_others, relation.unexplained, relation.misfit_mps, sound.lag_s
    )
    if margin <= -settings.margin_min and relation_of(spans, sums, settings, rival).holds(settings):
        return _refused(_explained(every, settings), evidence)
    if not relation.holds(settings):
        moves = not steps.by_positions and has_real_motion(spans, settings)
        return _refused(UNRELATED, evidence) if moves else evidence
    doubt = _explained(every, settings) if margin <= -settings.margin_doubt else ""
    return _Motion(steps, spans, sums, sound, evidence, doubt)


def _is_hidden(one: Explanation, steps: Steps, spans: Spans, settings: MountingSettings) -> bool:
    """Tell whether an explanation mirrors an axis of the accelerometers that carries no force.

    An aeroplane in coordinated turns has none to the side: the sign of that axis then shows nothing but its bias.
    """
    mirror = -one.gyro_turn
    if one.is_right_handed or one.turns_alike or np.trace(mirror) != 1.0 or (mirror != mirror.T).any():
        return False
    along = 0.5 * (np.eye(3) - mirror)  # the mirrored axis times itself
    places = (spans.first[:, None] + np.arange(settings.steps)).ravel()
    force = np.linalg.norm(steps.force_mps2[places] @ along, axis=1)
    return float(np.sqrt(np.nanmean(force**2))) < settings.hidden_force_mps2


def _explained(every: tuple[Explanation, ...], settings: MountingSettings) -> str:
    """Return what explains the increments: simple ones about as likely as the best."""
    near = [
        one for one in every if not one.is_sound and one.log_likelihood >= every[0].log_likelihood - settings.margin_min
    ]
    if every[0].scale == 1.0:
        near = [one for one in near if one.scale == 1.0]
    told = [_told(one) for one in near if one.turns_alike or one.is_right_handed] or [_told(every[0])]
    return ", or ".join(dict.fromkeys(told))


def _told(one: Explanation) -> str:
    """Return an unsound explanation in words."""
    if one.scale != 1.0:
        return IN_DEGREES if one.scale < 1.0 else IN_RADIANS
    if one.is_right_handed:
        return OTHER_AXES
    if one.turns_alike:
        return MIRRORED
    return REVERSED if (one.gyro_turn == np.eye(3)).all() else f"{MIRRORED}; and {OTHER_AXES}"


def _found(
    motion: _Motion | MountingEvidence, steps: Steps, vehicle: VehicleKind | None, settings: MountingSettings
) -> Mounting:
    """Return the turn that gravity and travel show, else why it is that of the case."""
    if isinstance(motion, MountingEvidence):
        gravity = gravity_of(steps)
        told = replace(motion, gravity_concentration=gravity.concentration)
        return _of_case(f"too little motion shows how it stands{_down_told(gravity)}", told)
    speed = settings.speed_min_mps if vehicle in ("rolls", "walks", None) else settings.flight_speed_min_mps
    looks = looks_of(steps, motion.spans, motion.sums, motion.sound.lag_s, speed, settings)
    turn, evidence = _nearest(looks, motion.evidence)
    measured = evidence.measured_deg
    body_from_case = turn if measured is None else from_angles(measured)
    rolls = vehicle in ("rolls", None)
    agree = correlations(steps, motion.sums, body_from_case, motion.sound.lag_s, speed, rolls=rolls)
    evidence = _with(evidence, agree)
    if vehicle == "walks":
        return _of_case("what is carried has no forward", evidence)
    if measured is None or looks.travel.count < settings.travel_steps_min:
        return _of_case("too little travel shows which way is forward", evidence)
    if min(looks.travel.concentration, looks.gravity.concentration) < settings.concentration_min:
        return _of_case("it does not travel along one axis of the case", evidence)
    if vehicle == "rolls":
        if _contradicts(agree):
            return _refused("speeding up, turning and travel do not show the same forward and right", evidence)
    elif not (vehicle is None and _moves_as_on_wheels(agree)) and not flies_nose_first(steps, agree, settings):
        return _of_case("a craft that may move in any direction does not show which way is forward", evidence)
    return _turned(turn, measured, evidence, settings)


def _moves_as_on_wheels(agree: Correlations) -> bool:
    """Tell whether the force is what speeding up and turning need, as on wheels."""
    return min(agree.along, agree.across, agree.turning) >= ON_WHEELS


def _down_told(gravity: Direction) -> str:
    """Return which axis of the case points down, where one does."""
    most = int(np.argmax(np.abs(gravity.vector)))
    if gravity.concentration < 0.9 or abs(gravity.vector[most]) < 0.9:
        return ""
    return f"; its {'xyz'[most]} axis points {'down' if gravity.vector[most] > 0.0 else 'up'}"


def _turned(turn: FloatArray, measured: FloatArray, evidence: MountingEvidence, settings: MountingSettings) -> Mounting:
    """Return the axis turn, or the measured one where the case stands at an angle."""
    seen = f"gravity and {counted(evidence.travel_steps, 'second')} of travel show"
    if evidence.off_square_deg > settings.square_within_deg:
        words = "{} the case at roll {:.0f}, pitch {:.0f}, yaw {:.0f} deg".format(seen, *measured)
        return Mounting("found", from_angles(measured), words, evidence)
    words = f"{seen} {axes_told(turn)}; the case stands {evidence.off_square_deg:.1f} deg off these axes"
    return Mounting("found", turn, words, evidence)


def _nearest(looks: Looks, evidence: MountingEvidence) -> tuple[FloatArray, MountingEvidence]:
    """Return the axis turn nearest to what gravity and travel show."""
    evidence = replace(
        evidence,
        gravity_concentration=looks.gravity.concentration,
        travel_concentration=looks.travel.concentration,
        travel_steps=looks.travel.count,
    )
    if not (looks.gravity.count and looks.travel.count):
        return np.eye(3), evidence
    measured, turns = measured_turn(looks), axis_turns()
    angles = angle_between_deg(measured, turns)
    first, second = np.argsort(angles)[:2]
    return turns[first], replace(
        evidence,
        measured_deg=frozen(angles_of(measured)),
        off_square_deg=float(angles[first]),
        next_turn_deg=float(angles[second]),
    )


def _with(evidence: MountingEvidence, agree: Correlations) -> MountingEvidence:
    return replace(
        evidence,
        along=agree.along,
        across=agree.across,
        turning=agree.turning,
        turning_ratio=agree.turning_ratio,
    )


def _contradicts(agree: Correlations) -> bool:
    """Tell whether a look at what rolls shows the other way."""
    return any(value < -LEAST_CORRELATION for value in (agree.along, agree.across, agree.turning))


def _stated(found: Mounting, stated: tuple[float, float, float], settings: MountingSettings) -> Mounting:
    """Return what the aircraft file states, refused where motion shows another turn."""
    turn = from_angles(stated)
    told = "roll {:g}, pitch {:g}, yaw {:g} deg".format(*stated)
    if found.source == "refused":
        return found
    if found.source == "found" and (off := _off_deg(found, turn)) > settings.contradiction_deg:
        reason = f"stated at {told}, but {found.words}: {off:.0f} deg apart"
        return _refused(reason, found.evidence)
    return Mounting("stated", turn, f"stated in the aircraft file: {told}", found.evidence)


def _logged(found: Mounting, logged: LoggedMounting, settings: MountingSettings) -> Mounting:
    """Return what the log tells, with a doubt where motion shows another turn."""
    if found.source == "refused":
        return found
    doubt = ""
    if found.source == "found" and (off := _off_deg(found, logged.body_from_case)) > settings.contradiction_deg:
        doubt = f"{found.words}: {off:.0f} deg from what the log tells"
    return Mounting("logged", logged.body_from_case, logged.words, found.evidence, doubt=doubt)


def _off_deg(found: Mounting, turn: FloatArray) -> float:
    measured = found.evidence.measured_deg
    shown = found.body_from_case if measured is None else from_angles(measured)
    return float(angle_between_deg(shown, turn))


def _refused(reason: str, evidence: MountingEvidence) -> Mounting:
    return Mounting("refused", np.eye(3), f"refused: {reason}", evidence, refused=reason)


def _of_case(reason: str, evidence: MountingEvidence) -> Mounting:
    return Mounting("case", np.eye(3), f"attitude is that of the case: {reason}", evidence)
