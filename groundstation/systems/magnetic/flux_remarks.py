"""Remarks on the deviation of a flux valve: what it rests on, and what cannot be told."""

from groundstation.base.angles import wrap_180
from groundstation.systems.magnetic.flux_answer import BankError, FluxDeviation
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings

WEAK_DIP_DEG = 75.0
TELLING_VARIATION_DEG = 0.5
LAGGING_S = 5.0


def flux_remarks(answer: FluxDeviation, is_levelled: bool, settings: MagneticFluxSettings) -> tuple[str, ...]:
    """Return what must be told beside the figures, one line each."""
    used = answer.reference
    common = f"{used.sigma_deg:.2f} deg" if used.sigma_deg is not None else "not known"
    told = [
        "the level of all errors (A) holds the mounting of the sensor; an error of the declination "
        f"({answer.declination.sigma_deg:.2f} deg) and of the true heading ({common}) goes into it one to one"
    ]
    unseen: dict[str, list[str]] = {}
    for item in answer.coefficients:
        if item.state == "not observable":
            unseen.setdefault(item.reason, []).append(item.letter)
    told += ["; ".join(f"{', '.join(letters)}: {reason}" for reason, letters in unseen.items())] if unseen else []
    told.append(_use(answer.bank_error, settings))
    if is_levelled:
        told.append(
            f"{answer.ins_topic} has roll and pitch: its heading is that of an AHRS, filtered and levelled, and no raw "
            "flux valve; its filter may hide a deviation for minutes"
        )
    if answer.wind is not None:
        told.append(
            f"the wind was solved without the compass: mean {answer.wind.north_mps:+.1f} m/s north, "
            f"{answer.wind.east_mps:+.1f} east, changes of about {answer.wind.changes_mps:.1f} m/s; airspeed x "
            f"{answer.wind.airspeed_scale:.3f}; a logged wind hangs on the compass and is not used"
        )
    if answer.dip_deg is not None and abs(answer.dip_deg) > WEAK_DIP_DEG:
        told.append(f"the dip is {answer.dip_deg:.0f} deg: the horizontal field is weak, bank and currents count more")
    if answer.logged_variation_deg is not None:
        apart = float(wrap_180(answer.logged_variation_deg - answer.declination.value_deg))
        if abs(apart) > TELLING_VARIATION_DEG:
            told.append(
                f"the log's own variation, {answer.logged_variation_deg:+.2f} deg, and {answer.declination.model}, "
                f"{answer.declination.value_deg:+.2f} deg, differ by {apart:+.2f} deg: A is against the latter"
            )
    if answer.heading_step_deg is not None:
        told.append(f"heading in steps of {answer.heading_step_deg:g} deg")
    return tuple(told)


def _use(bank: BankError, settings: MagneticFluxSettings) -> str:
    """Return what the turns say of the limits of use."""
    if bank.state != "found" or bank.lean is None or bank.lag_s is None:
        text = f"bank error and slaving are not observable ({bank.reason})"
        return (
            f"{text}: the heading in and after a turn is not judged, and a gyro slaved over minutes would bias A to E"
        )
    limit = f"{settings.use_error_max_deg:g} deg"
    if bank.lag95_s is not None and bank.lag95_s[0] >= LAGGING_S:
        text = f"the display follows its valve over about {bank.lag_s:.0f} s, as a slaved gyro does"
        wait = bank.after_turn_s or 0.0
        return f"{text}; by bank it was off by up to {bank.worst_deg or 0.0:.1f} deg" + (
            f": not for use within {wait:.0f} s after such a turn ({limit})" if wait >= 1.0 else ""
        )
    if bank.bank_max_deg is None:
        low, high = bank.lean95 or (bank.lean, bank.lean)
        told = f"{low:.1f} to {high:.1f} of the bank"
        return f"no bank error is seen: the sensor is kept level in turns (it leans by {told})"
    return (
        f"the sensor leans by {bank.lean:.2f} of the bank: above {bank.bank_max_deg:.1f} deg of bank its heading is "
        f"off by more than {limit}, and turns are left out"
    )
