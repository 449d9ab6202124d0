"""Answer about the ground stations of a session: rows of the cooperative answer."""

from typing import Literal

from groundstation.base.dataclasses import dataclass

StationVerdict = Literal["fits", "off", "one of several", "left out", "not judged"]


def digits_of(metres: float | None) -> int:
    """Return the decimals of a length: aircraft are off by metres, robots by centimetres.

    Examples
    --------
    >>> [digits_of(metres) for metres in (530.7, -12.3, 0.942, None)]
    [0, 1, 2, 0]
    """
    size = abs(metres) if metres is not None else 100.0
    return 0 if size >= 20.0 else 1 if size >= 2.0 else 2


@dataclass(frozen=True)
class StationRow:
    """One ground station as the ranges judge it.

    Parameters
    ----------
    station : str
    verdict : {'fits', 'off', 'one of several', 'left out', 'not judged'}
        ``one of several``: it or another of those with this verdict is off. ``left out``: its ranges are too long or
        too short by a delay (its clock), and are not used; alone with one of several: that, or the other is off.
        ``not judged``: no ranges, or none that would show an error.
    ranges : int
    chance : float
        Chance of residuals as bad as these when the station is right, times the number of questions asked, at most 1.
    shift_m, shift_sigma_m, shift_direction_deg : float or None
        From the place in the stations file to where the ranges put the station if it alone is off, and the sigma of the
        size; None where no shift can be seen.
    delay_m, delay_sigma_m : float or None
        By how much its ranges are too long if that alone is wrong.
    detectable_best_m, detectable_worst_m : float or None
        Smallest shift that is found with 95 %, in the best and in the worst direction; None: none is.
    metres_per_metre : float
        By how much a metre of shift moves the smoothed answer, worst direction, aircraft and time.
    moves_most : str
        That aircraft.
    stated_sigma_m, used_sigma_m : float
        Sigma of its place as stated, and as the answer takes it.
    survey_north_m, survey_east_m, survey_sigma_north_m, survey_sigma_east_m : float or None
        Where the answer puts it, off its place in the file, and the sigmas; None where it takes that place as exact.
    """

    station: str  #: Name in the stations file.
    verdict: StationVerdict
    ranges: int  #: Ranges to it.
    chance: float
    shift_m: float | None  #: How far from its stated place the ranges put it; null where no shift can be seen.
    shift_sigma_m: float | None  #: Standard deviation of the shift.
    shift_direction_deg: float | None  #: True direction of the shift.
    delay_m: float | None  #: By how much its ranges are too long, if that alone is wrong.
    delay_sigma_m: float | None  #: Standard deviation of the delay.
    detectable_best_m: float | None  #: Smallest shift that is found with 95 %, in the best direction.
    detectable_worst_m: float | None  #: The same in the worst direction; null: none is.
    metres_per_metre: float
    moves_most: str  #: Aircraft whose answer a shift of the station moves most.
    stated_sigma_m: float  #: Sigma of its place as stated.
    used_sigma_m: float  #: Sigma of its place as the answer takes it.
    survey_north_m: float | None  #: Where the answer puts it, north of its stated place.
    survey_east_m: float | None  #: Where the answer puts it, east of its stated place.
    survey_sigma_north_m: float | None  #: Standard deviation of survey_north_m.
    survey_sigma_east_m: float | None  #: Standard deviation of survey_east_m.


@dataclass(frozen=True)
class ProtectionRow:
    """Bound of an aircraft's smoothed error while a station is off by what the test finds.

    ``worst_m`` over the session, ``end_m`` at its end.
    """

    vehicle: str  #: Name of the aircraft.
    worst_m: float  #: Largest bound of the session.
    end_m: float  #: Bound at its end.


@dataclass(frozen=True)
class DatumRow:
    """One datum as the hypothesis that the stations file is in it, taken for WGS-84.

    Parameters
    ----------
    datum : str
    shift_m : float
        Largest error that a station would have.
    evidence : float
        Twice the log of the likelihood ratio against the file as it is.
    is_decidable : bool
        The session would tell it.
    is_told : bool
    """

    datum: str  #: Datum that the file may be in.
    shift_m: float
    evidence: float
    is_decidable: bool
    is_told: bool  #: Whether the session tells that it is.


@dataclass(frozen=True)
class StationsAnswer:
    """Ground stations as the session judges them.

    Parameters
    ----------
    rows : tuple of StationRow
    protection : tuple of ProtectionRow
    datums : tuple of DatumRow
    raised : dict of str to float
        Sigmas of INS and clocks (``cooperative.ins``) that were raised for the tests, because the session shows more
        than was believed, with the factor.
    repetition : float
        Factor by which readings of the stations tell less than as many independent ones.
    """

    rows: tuple[StationRow, ...]  #: Every station as the ranges judge it.
    protection: tuple[ProtectionRow, ...]  #: Bound of each aircraft's error by an undetected station.
    datums: tuple[DatumRow, ...]  #: Whether the stations file is in another datum.
    raised: dict[str, float]
    repetition: float

    @property
    def in_doubt(self) -> tuple[StationRow, ...]:
        """Stations that are off, or may be."""
        return tuple(row for row in self.rows if row.verdict not in ("fits", "not judged"))

    def with_verdict(self, verdict: StationVerdict) -> tuple[StationRow, ...]:
        """Return the stations of one verdict."""
        return tuple(row for row in self.rows if row.verdict == verdict)
