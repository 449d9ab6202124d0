"""Answer of the INS error estimator (system 2): errors of the INS found against GNSS, and what they rest on."""

from dataclasses import dataclass, field

from groundstation.results.figures import FigureData


@dataclass(frozen=True)
class StateEstimate:
    """One state of a channel at the last time GNSS was there.

    ``observability`` is 1 - sigma / sigma at the start (of the state alone, without GNSS), 0 to 1: near 0 the data say
    nothing about it. ``observable_from_s`` is the flight time from which it stays above one half, None if never.
    """

    name: str
    title: str
    unit: str
    value: float
    sigma: float
    observability: float
    observable_from_s: float | None


@dataclass(frozen=True)
class ChannelResult:
    """One horizontal channel, ``north`` or ``east``. Error = INS - truth, innovation = measured - predicted.

    ``nis`` is the mean normalised innovation squared per measurement with its 95 % chi-square limits ``nis_low``,
    ``nis_high`` (None where the measurement noise was inflated for colour: then NIS is below one by design);
    ``share_inside95`` of the innovations inside their own 95 % band; ``rejected`` of ``innovations`` were gated.
    """

    name: str
    states: tuple[StateEstimate, ...]
    nis: float
    nis_low: float | None
    nis_high: float | None
    share_inside95: float
    innovations: int
    rejected: int
    velocity_error_rms_mps: float | None
    position_error_rms_m: float | None


@dataclass(frozen=True)
class RealOutage:
    """An interval without GNSS in the log itself: the filter forecast through it.

    ``jump_m`` is how far the forecast position error was from what GNSS showed on return, ``sigma_m`` what the
    forecast claimed (both radial); None when GNSS did not come back.
    """

    start_s: float
    end_s: float
    length_s: float
    jump_m: float | None
    sigma_m: float | None


@dataclass(frozen=True)
class AzimuthEstimate:
    """Azimuth (heading) error of the INS from what turns do to its velocity error; offered only where they allow it.

    ``observable`` says whether ``sigma_deg`` is below the limit of the settings; if not, ``error_deg`` is None.
    """

    observable: bool
    error_deg: float | None
    sigma_deg: float | None
    turns: int
    velocity_change_mps: float
    reason: str


@dataclass(frozen=True)
class InertialResult:
    """INS errors of one flight.

    Parameters
    ----------
    ins_topic, gnss_topic : str
        The pair used.
    ins_class : str
        Noise parameters used, by name; ``ins_class_origin`` says who chose them.
    kind : str
        ``"unaided"``, or ``"gnss_aided"`` for an INS that never drifts from GNSS: then a forecast means nothing.
    transition : str
        ``"exact"`` or ``"first_order"`` (I + A T of the paper).
    epochs, gnss_seconds
        Epochs compared, and seconds of the flight with GNSS.
    radial_error_rate_50_nmiph, radial_error_rate_95_nmiph : float or None
        Radial position error over time since the first epoch, nautical miles per hour, median and 95 % over epochs
        later than ten minutes.
    settings : dict
        Every parameter of model, noise and gates as used.
    figures : tuple of FigureData
        ``inertial_states``, ``inertial_observability``, ``inertial_track``.
    """

    ins_topic: str
    gnss_topic: str
    ins_class: str
    ins_class_origin: str
    kind: str
    kind_reason: str
    transition: str
    epochs: int
    gnss_seconds: float
    channels: tuple[ChannelResult, ...]
    radial_error_rate_50_nmiph: float | None
    radial_error_rate_95_nmiph: float | None
    velocity_error_rms_mps: float | None
    largest_radial_error_m: float | None
    outages: tuple[RealOutage, ...] = ()
    azimuth: AzimuthEstimate | None = None
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()
