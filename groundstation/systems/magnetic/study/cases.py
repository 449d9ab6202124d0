"""Cases of the magnetic study: families of flights, sweeps, incomplete figures."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from groundstation.base.dataclasses import dataclass
from groundstation.simulation.legs import AirTurn, Leg
from groundstation.simulation.magnetic_family import MagneticFamilySettings

FIRST_SEED = 7_000_000  # no smaller seed belongs to this study: tests and tuning used small ones
SEEDS_PER_STUDY = 100_000
PUBLISHED_BIAS_DEG = {10.0: 0.12, 20.0: 0.46, 30.0: 1.04}  # by bank; the design's figures, measured elsewhere
PUBLISHED_FIELD_NT = (17e3, 0.0, 50e3)
BANK_DEG, TURN_DEG = 20.0, 400.0
FIRST_TURN = 8  # place of the figure's right turn among the legs of the family

JUDGED = MagneticFamilySettings(field_error_sigmas=1.0)
SWEPT = MagneticFamilySettings(
    bank_deg=BANK_DEG,
    turn_deg=TURN_DEG,
    figures=1,
    hard_iron_sigma_nt=1500.0,
    soft_iron_sigma=0.02,
    misalignment_sigma_deg=0.0,
    scale_sigma=0.0,
    latency_s=0.0,
    latitude_deg=(55.97, 55.97),
    longitude_deg=(37.41, 37.41),
    field_error_sigmas=1.0,
)
EXACT = replace(
    SWEPT,
    bank_sigma_deg=0.0,
    noise_nt=0.0,
    correlated_nt=0.0,
    heading_error_sigma_deg=0.0,
    drift_sigma_dph=0.0,
    attitude_error_sigma_deg=0.0,
    attitude_wander_deg=0.0,
    field_error_sigmas=0.0,
)
EXACT_BANKS_DEG = (10.0, 15.0, 20.0, 25.0, 30.0)


@dataclass(frozen=True)
class Setup:
    """Conditions of the flights of one point; equal setups are flown once.

    Parameters
    ----------
    family : MagneticFamilySettings
    is_aligned : bool
        Whether the taxi before the flight has aligned the INS.
    hours_since_taxi : float
        What the INS has drifted on for between the taxi and the part of the flight that is simulated.
    """

    family: MagneticFamilySettings
    is_aligned: bool = True
    hours_since_taxi: float = 0.0


@dataclass(frozen=True)
class Sweep:
    """One quantity that is varied; all others stay at their reference.

    Parameters
    ----------
    name : str
    column : str
        Name of the quantity with its unit.
    title : str
    points : tuple of (float, Setup)
    """

    name: str
    column: str
    title: str
    points: tuple[tuple[float, Setup], ...]


REFERENCE = Setup(SWEPT)
NOISE_FACTORS = (0.0, 1.0, 3.0, 10.0)
ATTITUDE_FACTORS = (0.0, 1.0, 2.0, 5.0)


def _sweep(name: str, column: str, title: str, values: tuple[float, ...], of: Callable[[float], Setup]) -> Sweep:
    return Sweep(name, column, title, tuple((value, of(value)) for value in values))


def _family(**changes: float | tuple[float, float]) -> Setup:
    return Setup(replace(SWEPT, **changes))  # type: ignore[arg-type]


BANK = _sweep(
    "bank", "bank_deg", "Bank", (10.0, 15.0, 20.0, 25.0, 30.0, 40.0), lambda bank_deg: _family(bank_deg=bank_deg)
)
DIP = _sweep(
    "dip",
    "latitude_deg",
    "Latitude, hence dip",
    (5.0, 25.0, 40.0, 55.97, 65.0, 70.0),
    lambda latitude_deg: _family(latitude_deg=(latitude_deg, latitude_deg)),
)
NOISE = _sweep(
    "noise",
    "noise_nt",
    "Noise of the magnetometer (white; a correlated part of two thirds of it beside it)",
    tuple(SWEPT.noise_nt * factor for factor in NOISE_FACTORS),
    lambda noise_nt: _family(noise_nt=noise_nt, correlated_nt=noise_nt * SWEPT.correlated_nt / SWEPT.noise_nt),
)
ATTITUDE = _sweep(
    "attitude",
    "attitude_wander_deg",
    "Error of roll and pitch (sigma of what wanders over 120 s; a constant part of twice that)",
    tuple(SWEPT.attitude_wander_deg * factor for factor in ATTITUDE_FACTORS),
    lambda wander_deg: _family(
        attitude_wander_deg=wander_deg,
        attitude_error_sigma_deg=wander_deg * (SWEPT.attitude_error_sigma_deg / SWEPT.attitude_wander_deg),
    ),
)
COVERAGE = _sweep(
    "coverage",
    "turn_deg",
    "Length of each branch, hence coverage",
    (300.0, 330.0, 345.0, 360.0, 375.0, 400.0),
    lambda turn_deg: _family(turn_deg=turn_deg),
)
DRIFT = _sweep(
    "drift",
    "drift_sigma_deg_per_h",
    "Drift of the INS, one hour from taxi to the figure",
    (0.0, 0.05, 0.1, 0.3, 1.0),
    lambda drift: Setup(replace(SWEPT, drift_sigma_dph=drift), hours_since_taxi=1.0),
)
AZIMUTH = _sweep(
    "azimuth",
    "azimuth_sigma_deg",
    "Azimuth error of an INS that no taxi has aligned",
    (0.0, 0.1, 1.0 / 3.0, 1.0, 3.0),
    lambda sigma_deg: Setup(replace(SWEPT, heading_error_sigma_deg=sigma_deg, drift_sigma_dph=0.0), is_aligned=False),
)
CLAIM = _sweep(
    "claim",
    "bank_deg",
    "Bank, without any noise",
    EXACT_BANKS_DEG,
    lambda bank_deg: Setup(replace(EXACT, bank_deg=bank_deg), is_aligned=False),
)
SWEEPS = (BANK, DIP, NOISE, ATTITUDE, COVERAGE, DRIFT, AZIMUTH)


def setups(sweeps: Sequence[Sweep] = SWEEPS) -> tuple[Setup, ...]:
    """Return every setup of some sweeps and of the claim once.

    Examples
    --------
    >>> sum(len(sweep.points) for sweep in (*SWEEPS, CLAIM)) - len(setups())  # the reference is in five of them
    4
    """
    return tuple(dict.fromkeys(setup for sweep in (*sweeps, CLAIM) for _value, setup in sweep.points))


Legs = tuple[Leg, ...]
INCOMPLETE: dict[str, Callable[[float], Legs]] = {
    "right turn alone": lambda bank: (AirTurn(TURN_DEG, bank),),
    "half circles": lambda bank: (AirTurn(180.0, bank), AirTurn(-180.0, bank)),
    "three quarters of a circle": lambda bank: (AirTurn(270.0, bank), AirTurn(-270.0, bank)),
    "30 deg short of a circle": lambda bank: (AirTurn(330.0, bank), AirTurn(-330.0, bank)),
    "banks 6 deg apart": lambda bank: (AirTurn(TURN_DEG, bank), AirTurn(-TURN_DEG, bank + 6.0)),
    "bank growing by 14 deg": lambda bank: (AirTurn(TURN_DEG, bank, 14.0), AirTurn(-TURN_DEG, bank, 14.0)),
    "bank of 55 deg": lambda bank: (AirTurn(TURN_DEG, bank + 35.0), AirTurn(-TURN_DEG, bank + 35.0)),
}


def with_figure(legs: Legs, figure: Legs) -> Legs:
    """Return the legs of a family's flight with another first figure."""
    return (*legs[:FIRST_TURN], *figure, *legs[FIRST_TURN + 2 :])


# The second, wider family: docs/evidence/magnetic.md tells it in words


@dataclass(frozen=True)
class WideCell:
    """Whole flights with one disturbance more than the judged family.

    ``is_load_logged``: the log has the electric load.
    """

    family: MagneticFamilySettings
    is_load_logged: bool = True


def _wide(**changes: float | int | tuple[float, float]) -> WideCell:
    return WideCell(replace(JUDGED, **changes))  # type: ignore[arg-type]


WIDE: dict[str, WideCell] = {
    "plain": _wide(),
    "field twice as wrong": _wide(field_error_sigmas=2.0),
    "anomaly": _wide(anomaly_nt=150.0),
    "attitude wander": _wide(attitude_wander_deg=0.1),
    "slow attitude wander": _wide(attitude_wander_deg=0.1, attitude_wander_s=400.0),
    "69 deg north": _wide(latitude_deg=(69.0, 69.0)),
    "steep": _wide(bank_deg=35.0),
    "flat": _wide(bank_deg=11.0),
    "one figure": _wide(figures=1, straights=2),
    "late magnetometer": _wide(latency_s=0.3),
    "load that is not logged": replace(_wide(coupling_sigma_nt_per_a=4.0, load_a=20.0), is_load_logged=False),
    "several at once": _wide(attitude_wander_deg=0.07, anomaly_nt=80.0, latitude_deg=(55.0, 68.0), bank_deg=25.0),
}


def seed_of(seed: int, run: int) -> int:
    """Return the seed of one flight of a study.

    Examples
    --------
    >>> seed_of(71, 3)
    14100003
    """
    return FIRST_SEED + SEEDS_PER_STUDY * seed + run
