"""Kalman filter and smoother of both channels, on irregular epochs and across gaps."""

from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.methods.ins_noise import InsNoise
from groundstation.methods.kalman import filter as kalman
from groundstation.methods.kalman import smoother
from groundstation.methods.kalman.arrays import REJECTED, Drive
from groundstation.systems.inertial.channel_group import ChannelGroup, GroupRun
from groundstation.systems.inertial.model import POSITION, SIZE, VELOCITY, ChannelModel, FloatArray
from groundstation.systems.inertial.seams import PATIENCE_S, Seam
from groundstation.systems.inertial.steps import Steps

FIRST_SAMPLES = 15
ROOM_OF_THE_GATE = 3.0  # times the sigma of a single measurement
STANDARD_GATE = 25.0  # squared sigmas


@dataclass(frozen=True)
class DifferenceEpochs:
    """Inputs of the filter: differences INS minus GNSS on one strictly increasing time axis.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Flight seconds.
    position_m, velocity_mps : ndarrays, shape (n, c)
        INS minus GNSS; channels north, east. NaN where there is no GNSS (or it is not believed).
    drag_per_s : ndarray, shape (n, 2, 2)
        Known rates by which the position error of channel i grows with that of channel j: metres north and east are
        measured on a sphere, so that an error east shrinks as the aircraft flies to the pole.
    is_reset : ndarray of bool, shape (n,)
        The INS was reset between the epoch before and this one.
    """

    time_s: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray
    drag_per_s: FloatArray
    is_reset: BoolArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    def __len__(self) -> int:
        return len(self.time_s)

    @classmethod
    def plain(cls, time_s: FloatArray, position_m: FloatArray, velocity_mps: FloatArray) -> "DifferenceEpochs":
        """Epochs of an INS that was never reset, without the effect of the sphere."""
        n = len(time_s)
        return cls(time_s, position_m, velocity_mps, np.zeros((n, 2, 2)), np.zeros(n, dtype=bool))

    @property
    def interval_s(self) -> float:
        """Median interval of the epochs, with GNSS or without, seconds; 1 for fewer than two."""
        return float(np.median(np.diff(self.time_s))) if len(self) > 1 else 1.0

    @cached_property
    def gnss_intervals_s(self) -> tuple[float, float]:
        """Median intervals between positions and between velocities; 1 s for fewer than two."""
        found = []
        for measured in (self.position_m, self.velocity_mps):
            times = self.time_s[np.isfinite(measured).any(axis=1)]
            found.append(float(np.median(np.diff(times))) if len(times) > 1 else 1.0)
        return found[0], found[1]

    @property
    def has_gnss(self) -> BoolArray:
        """Epochs with a position or velocity compared in at least one channel, shape (n,)."""
        return np.asarray(np.isfinite(self.position_m).any(axis=1) | np.isfinite(self.velocity_mps).any(axis=1))


@dataclass(frozen=True)
class Initial:
    """States (6, c) and covariances (g, 6, 6) before the first epoch.

    g = 1 where the channels share one.
    """

    x: FloatArray
    P: FloatArray

    def of(self, group: list[int]) -> FloatArray:
        """States of some channels."""
        return np.ascontiguousarray(self.x[:, group])

    def covariance(self, channel: int) -> FloatArray:
        """Covariance of a channel."""
        return np.ascontiguousarray(self.P[min(channel, len(self.P) - 1)])


@dataclass(frozen=True)
class ChannelsRun:
    """The filter's history. n epochs, c channels; measurement axis: position, velocity.

    Parameters
    ----------
    parts : tuple of kalman.ChannelsRun
        What the core ran: one for both channels, which share a covariance then (g = 1), or one each (g = 2).
    x : ndarray, shape (n, 6, c)
        Estimates after each epoch (forecast where GNSS was absent).
    P : ndarray, shape (g, n, 6, 6)
        Covariance, one for both channels (g = 1) or one each (g = 2, where GNSS gave the channels apart).
    innovation : ndarray, shape (n, 2, c)
        Measured minus predicted, NaN where absent.
    innovation_variance : ndarray, shape (n, 2, c)
    used : ndarray of int8, shape (n, 2, c)
        Rejected -1, absent 0, used 1.
    gain : ndarray, shape (g, n, 2, 6)
    reopened : int
        How often GNSS was rejected for so long that the filter took it to be right after all.
    seams_of_parts : tuple of tuples of Seam
        Of each part the outages at whose end GNSS was used although it was beyond the gate.
    """

    epochs: DifferenceEpochs
    model: ChannelModel
    noise: InsNoise
    steps: Steps
    parts: tuple[kalman.FilterRun, ...]
    x: FloatArray
    P: FloatArray
    innovation: FloatArray
    innovation_variance: FloatArray
    used: NDArray[np.int8]
    gain: FloatArray
    reopened: int = 0
    seams_of_parts: tuple[tuple[Seam, ...], ...] = ()

    @property
    def seams(self) -> tuple[Seam, ...]:
        """Seams of all parts in the order of time."""
        return tuple(sorted((seam for part in self.seams_of_parts for seam in part), key=lambda seam: seam.back))

    @property
    def groups(self) -> list[list[int]]:
        """Channels of each part."""
        channels = list(range(self.x.shape[2]))
        return [channels] if len(self.parts) == 1 else [[channel] for channel in channels]

    def measured(self, kind: int) -> FloatArray:
        """Return position (0) or velocity (1) differences, shape (n, c).

        NaN also where the filter rejected them.
        """
        values = (self.epochs.position_m, self.epochs.velocity_mps)[kind]
        return np.where(self.used[:, kind] == REJECTED, np.nan, values)

    def covariance(self, channel: int) -> FloatArray:
        """Covariance of a channel, shape (n, 6, 6)."""
        return np.asarray(self.P[min(channel, len(self.P) - 1)])

    def covariance_beforehand(self, channel: int) -> FloatArray:
        """Return the covariance of a channel as claimed before GNSS came back, shape (n, 6, 6).

        It differs inside outages.
        """
        seams = self.seams_of_parts[min(channel, len(self.P) - 1)] if self.seams_of_parts else ()
        out = np.array(self.covariance(channel)) if seams else self.covariance(channel)
        for seam in seams:
            out[seam.last + 1 : seam.back] /= seam.factor**2
        return out

    @cached_property
    def covariance_without_data(self) -> FloatArray:
        """Covariance Pi of the true states at every epoch without measurements, shape (n, 6, 6)."""
        nothing = np.full((len(self.epochs), 1), np.nan)
        blind = replace(DifferenceEpochs.plain(self.epochs.time_s, nothing, nothing), is_reset=self.epochs.is_reset)
        return frozen(run_filter(blind, self.model, self.noise, steps=self.steps).P[0])

    def sigma(self, channel: int) -> FloatArray:
        """Standard deviations of a channel's states, shape (n, 6)."""
        return np.asarray(np.sqrt(np.maximum(np.einsum("nii->ni", self.covariance(channel)), 0.0)))


def initial_of(epochs: DifferenceEpochs, noise: InsNoise) -> Initial:
    """Return a start from what the first samples show.

    A recording may begin in flight, hours after the alignment of the INS. Position and velocity error are the medians
    of the first :data:`FIRST_SAMPLES` differences, with the class's sigma.
    """
    x = np.zeros((SIZE, epochs.position_m.shape[1]))
    for state, measured in ((POSITION, epochs.position_m), (VELOCITY, epochs.velocity_mps)):
        for channel in range(x.shape[1]):
            known = measured[np.isfinite(measured[:, channel]), channel]
            if len(known):
                x[state, channel] = float(np.median(known[:FIRST_SAMPLES]))
    return Initial(x, np.diag(noise.initial_variances())[None])


def run_filter(
    epochs: DifferenceEpochs,
    model: ChannelModel,
    noise: InsNoise,
    *,
    gate: float = STANDARD_GATE,
    initial: Initial | None = None,
    steps: Steps | None = None,
) -> ChannelsRun:
    """Estimate the errors of both channels; where GNSS is absent the states are forecast.

    Parameters
    ----------
    epochs : DifferenceEpochs, n >= 1
    model : ChannelModel
    noise : InsNoise
    gate : float
        Innovations with a larger squared ratio to their variance are rejected and counted.
    initial : Initial, optional
        Where an earlier run left off; default: nothing is known but the class.
    steps : Steps, optional
        Default: those of the model and the noise.

    Returns
    -------
    FilterRun

    Source: Neusypin et al., 2003; covariance update in Joseph's form (Bierman, 1977).
    """
    steps = steps or Steps.between(epochs.time_s, model, noise)
    channels = epochs.position_m.shape[1]
    z = np.stack([epochs.position_m, epochs.velocity_mps], axis=1)
    together = bool((np.isfinite(z) == np.isfinite(z[:, :, :1])).all())
    groups = [list(range(channels))] if together else [[channel] for channel in range(channels)]
    drag = epochs.drag_per_s * np.diff(epochs.time_s, prepend=epochs.time_s[:1])[:, None, None]
    first = initial or Initial(np.zeros((SIZE, channels)), np.diag(noise.initial_variances())[None])
    weighted, believed = measurement_variances(epochs, noise)
    patience, parts = patience_of(epochs), list[GroupRun]()
    for group in groups:  # the channel north comes first: it is not dragged by the other
        own, measured = (drag, z) if together else (np.ascontiguousarray(drag[:, group][:, :, group]), z[:, :, group])
        drive = Drive(POSITION, own, _pushed(drag, group, [part.run.x for part in parts]))
        start = kalman.Start(first.of(group), first.covariance(group[0]))
        alike = ChannelGroup(
            *(epochs.time_s, measured, epochs.is_reset, drive, weighted, believed, patience, gate, start)
        )
        parts.append(alike.run_over_seams(steps))
    records, n = [part.run.record for part in parts], len(epochs)
    shared = [(len(group), record) for group, record in zip(groups, records, strict=True)]
    seams = tuple(part.seams for part in parts)
    return ChannelsRun(
        epochs=epochs,
        model=model,
        noise=noise,
        steps=parts[0].steps,
        parts=tuple(part.run for part in parts),
        x=_joined([record.x for record in records]),
        P=_stacked([record.P for record in records]),
        innovation=_joined([record.y.reshape(n, 2, -1) for record in records]),
        innovation_variance=_joined([_shared(record.S, count) for count, record in shared]),
        used=_joined([_shared(part.mark, len(group)) for part, group in zip(parts, groups, strict=True)]),
        gain=_stacked([record.K.reshape(n, 2, SIZE) for record in records]),
        reopened=max(part.run.reopened for part in parts),
        seams_of_parts=seams,
    )


def _shared(values: NDArray[Any], count: int) -> NDArray[Any]:
    """Repeat a figure that channels share, 2 n numbers, for each: shape (n, 2, c), read-only."""
    return np.broadcast_to(values.reshape(-1, 2, 1), (values.size // 2, 2, count))


def _joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """Groups of channels side by side; a single one is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)


def _stacked(parts: list[FloatArray]) -> FloatArray:
    """Groups on a first axis; a single one is not copied."""
    return parts[0][None] if len(parts) == 1 else np.stack(parts)


def measurement_variances(epochs: DifferenceEpochs, noise: InsNoise) -> tuple[FloatArray, FloatArray]:
    """Return the variances of position and velocity for weighting and for the gate.

    Shape (2,) each: as they are weighted, and as a single one errs. The first are inflated for slow errors; the second
    are not, or the gate would be as wide as the inflation, but leave room for a receiver worse than the class thinks
    and for the lag of a filter that weighs it little.
    """
    weighted = [noise.gnss.variances(interval)[kind] for kind, interval in enumerate(epochs.gnss_intervals_s)]
    believed = replace(noise.gnss, is_inflated=False).variances(1.0)
    return np.array(weighted), ROOM_OF_THE_GATE**2 * np.array(believed)


def patience_of(epochs: DifferenceEpochs) -> Int64Array:
    """Return the count of rejections in a row after which GNSS is taken to be right.

    Shape (2,), one of each kind.
    """
    return np.array([max(1, round(PATIENCE_S / interval)) for interval in epochs.gnss_intervals_s], dtype=np.int64)


def _pushed(drag: FloatArray, group: list[int], earlier: list[FloatArray]) -> FloatArray:
    """Return the metres by which a channel run alone is dragged by the one before, (n, c)."""
    push = np.zeros((len(drag), len(group)))
    if len(group) == 1 and earlier:
        north = earlier[0][:, POSITION, 0]
        push[1:, 0] = drag[1:, group[0], 0] * north[:-1]
    return push


@dataclass(frozen=True)
class SmoothedErrors:
    """Smoothed states and variances, both (n, 6, c), NaN outside the interval asked for."""

    x: FloatArray
    variance: FloatArray


def smooth(run: ChannelsRun, first: int = 0, last: int | None = None) -> SmoothedErrors:
    """Smooth epochs ``first`` to ``last`` (both included) with the data up to ``last``.

    Source: Rauch, Tung, Striebel, 1965, in the form of Bryson and Frazier (Bierman, 1973).
    """
    parts = [smoother.smooth(part, first, last) for part in run.parts]
    shapes = [(*part.variance.shape, len(group)) for part, group in zip(parts, run.groups, strict=True)]
    variances = [np.broadcast_to(part.variance[:, :, None], shape) for part, shape in zip(parts, shapes, strict=True)]
    return SmoothedErrors(_joined([part.x for part in parts]), _joined(variances))
