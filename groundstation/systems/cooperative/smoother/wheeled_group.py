"""Vehicles on wheels as a group: odometry and camera of ``wheeled_vehicle.py``, in arrays.

A test compares both. What a camera sees of another vehicle is late as well: a peer is taken where it was then.
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.sight import Motion, OutputStates, RangeErrors, Sight
from groundstation.systems.cooperative.vehicles import SAME_TIME_S
from groundstation.systems.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import Odometry


class WheeledGroup:
    """Vehicles on wheels with the same states."""

    def __init__(
        self, vehicles: Sequence[WheeledVehicle], tracks: Sequence[Odometry], settings: CooperativeSettings
    ) -> None:
        self._vehicles, self._tracks = tuple(vehicles), tuple(tracks)
        states = vehicles[0].states
        self.size, self.count = len(states), len(vehicles)
        self.at = {name: number for number, name in enumerate(states)}
        self._first = np.concatenate([[0], np.cumsum([len(track) for track in tracks])]).astype(np.int64)
        self.speed_mps = np.concatenate([track.speed_mps for track in tracks])
        self.turn_radps = np.deg2rad(np.concatenate([track.turn_rate_dps for track in tracks]))
        gaps = [track.gap_s if len(track.gap_s) else np.zeros(len(track)) for track in tracks]
        self._density = np.array([vehicle.density for vehicle in vehicles])
        self._unread = np.concatenate(  # variances that a held reading adds in a second: way, turn
            [gap[:, None] * np.array(vehicle.unread) for gap, vehicle in zip(gaps, vehicles, strict=True)]
        )
        belief = settings.odometry
        self._along, self._slip = belief.along_m_per_sqrt_s**2, belief.slip_m_per_sqrt_m**2
        self._turning = float(np.deg2rad(belief.turn_deg_per_sqrt_s)) ** 2
        self._own_s = np.zeros((0, 0))
        self._steps: list[tuple[Int64Array, Int64Array, FloatArray]] = []
        self._starts: list[Int64Array] = []

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return states and their variances at the start, (v, n) each."""
        starts = [vehicle.start() for vehicle in self._vehicles]
        return np.array([x for x, _ in starts]), np.array([np.diag(P) for _, P in starts])

    def epoch(self, who: int, at_s: FloatArray) -> Int64Array:
        """Return the epochs whose readings hold at some times, as rows of all vehicles."""
        found = np.searchsorted(self._tracks[who].time_s, at_s + SAME_TIME_S) - 1
        return np.asarray(self._first[who] + np.maximum(found, 0))

    def set_knots(self, own_s: FloatArray) -> None:
        """Take the times of the knots (t, v); cut the steps between them where a reading changes."""
        self._own_s = own_s
        parts: list[tuple[Int64Array, Int64Array, Int64Array, FloatArray]] = []
        for who, track in enumerate(self._tracks):
            cuts = track.time_s[(track.time_s > own_s[0, who]) & (track.time_s < own_s[-1, who])]
            edges = np.unique(np.concatenate([own_s[:, who], cuts]))
            edges = edges[np.concatenate([[True], np.diff(edges) > SAME_TIME_S])] if len(edges) else edges
            interval = np.searchsorted(own_s[:, who], edges[:-1] + SAME_TIME_S, side="right") - 1
            number = np.arange(len(interval)) - np.searchsorted(interval, interval)
            parts.append((interval * self.count + who, number, self.epoch(who, edges[:-1]), np.diff(edges)))
        row, number, epoch, step_s = (np.concatenate(column) for column in zip(*parts, strict=True))
        self._steps, self._starts = [], []
        for turn in range(int(number.max(initial=-1)) + 1):
            mine = np.flatnonzero(number == turn)
            mine = mine[np.argsort(row[mine], kind="stable")]
            self._steps.append((row[mine], epoch[mine], step_s[mine]))
            self._starts.append(np.searchsorted(row[mine], np.arange(len(own_s)) * self.count))

    def move(self, x: FloatArray, first: int, last: int) -> Motion:
        """Move states (l, v, n) from the knots first to last - 1 to those behind them."""
        n, many = self.size, (last - first) * self.count
        moved = x.reshape(many, n).copy()
        phi, noise = np.zeros((many, n, n)), np.zeros((many, n, n))
        phi[:, range(n), range(n)] = 1.0
        for turn, ((row, epoch, step_s), starts) in enumerate(zip(self._steps, self._starts, strict=True)):
            part = slice(starts[first], starts[last])
            if part.start == part.stop:
                continue
            at = row[part] - first * self.count
            after, one, added = self._step(moved[at], epoch[part], step_s[part], noisy=True)
            moved[at] = after
            if turn == 0:
                phi[at], noise[at] = one, added
            else:
                phi[at], noise[at] = one @ phi[at], one @ noise[at] @ one.swapaxes(1, 2) + added
        shape = (last - first, self.count, n)
        return moved.reshape(shape), phi.reshape(*shape, n), noise.reshape(*shape, n)

    def factors(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the factors of speed and turn rate, (m,) each."""
        ones = np.ones(len(x))
        speed = 1.0 - x[:, self.at["speed_scale"]] if "speed_scale" in self.at else ones
        return speed, 1.0 - x[:, self.at["turn_scale"]] if "turn_scale" in self.at else ones

    def _step(self, x: FloatArray, epoch: Int64Array, step_s: FloatArray, *, noisy: bool) -> Motion:
        """Move states (m, n) on while one reading holds; a step may go back, without noise."""
        m, n, at = len(x), self.size, self.at
        speed, turn = self.speed_mps[epoch], self.turn_radps[epoch]
        by_speed, by_turn = self.factors(x)
        way, turned = speed * by_speed * step_s, turn * by_turn * step_s
        middle = x[:, 2] + 0.5 * turned
        cosine, sine = np.cos(middle), np.sin(middle)
        moved = x.copy()
        moved[:, 0] += way * cosine
        moved[:, 1] += way * sine
        moved[:, 2] += turned
        phi = np.zeros((m, n, n))
        phi[:, range(n), range(n)] = 1.0
        phi[:, 0, 2], phi[:, 1, 2] = -way * sine, way * cosine
        if "speed_scale" in at:
            phi[:, 0, at["speed_scale"]], phi[:, 1, at["speed_scale"]] = (
                -speed * step_s * cosine,
                -speed * step_s * sine,
            )
        if "turn_scale" in at:
            half = -0.5 * turn * step_s
            phi[:, 0, at["turn_scale"]], phi[:, 1, at["turn_scale"]] = -way * sine * half, way * cosine * half
            phi[:, 2, at["turn_scale"]] = 2.0 * half
        noise = np.zeros((m, n, n))
        if noisy:
            is_moving = (speed != 0.0) | (turn != 0.0)
            across = np.where(is_moving, self._slip * np.abs(way), 0.0)
            along = np.where(is_moving, self._along * step_s, 0.0) + across
            unread = self._unread[epoch] * step_s[:, None]
            noise[:, 0, 0] = along * cosine**2 + across * sine**2 + unread[:, 0]
            noise[:, 1, 1] = along * sine**2 + across * cosine**2 + unread[:, 0]
            noise[:, 0, 1] = noise[:, 1, 0] = (along - across) * sine * cosine
            noise[:, 2, 2] = np.where(is_moving, self._turning * step_s, 0.0) + unread[:, 1]
            noise[:, range(3, n), range(3, n)] = self._density[0] * step_s[:, None]
        return moved, phi, noise

    def ends(self, who: Int64Array, time_s: FloatArray, knot: Int64Array) -> "WheeledEnds":
        """Return ends at vehicles of this group at some times, each seen from a knot."""
        return WheeledEnds(self, who, time_s, self._own_s[knot, who])

    def short(self, x: FloatArray, epoch: Int64Array, step_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return states moved by short steps, and the transitions."""
        moved, phi, _ = self._step(x, epoch, step_s, noisy=False)
        return moved, phi

    def states_at(self, who: int, time_s: FloatArray, knot: Int64Array, x: FloatArray, P: FloatArray) -> OutputStates:
        """Return positions, states and covariances of one vehicle at some times."""
        own_s = self._own_s[knot, who]
        state, phi = self.short(x, self.epoch(who, np.minimum(own_s, time_s)), time_s - own_s)
        position_m = np.column_stack([state[:, :2], np.zeros(len(state))])
        return OutputStates(position_m, state, phi @ P @ phi.swapaxes(1, 2), phi)


class WheeledEnds:
    """Ends of measurements at vehicles on wheels."""

    clock: FloatArray | None = None
    receiver_clock: FloatArray | None = None
    height: FloatArray | None = None

    def __init__(self, group: WheeledGroup, who: Int64Array, time_s: FloatArray, own_s: FloatArray) -> None:
        self._group, self.lag = group, group.at.get("lag_s", -1)
        self.level_m = np.zeros(len(who))
        self._step_s, self._held, self._read = time_s - own_s, np.zeros_like(who), np.zeros_like(who)
        for index in range(group.count):
            mine = who == index
            self._held[mine] = group.epoch(index, np.minimum(time_s, own_s)[mine])
            self._read[mine] = group.epoch(index, time_s[mine] - 2.0 * SAME_TIME_S)
        self._is_at_knot = bool((np.abs(self._step_s) <= SAME_TIME_S).all())

    def sight(self, x: FloatArray, rows: slice, late_s: FloatArray | None) -> Sight:
        """See from the states (m, n) of some of the ends, ``late_s`` before their stamps."""
        group, m, n = self._group, len(x), self._group.size
        at, read, phi = group.at, self._read[rows], None
        if not self._is_at_knot:
            x, phi = group.short(x, self._held[rows], self._step_s[rows])
        speed, turn = group.speed_mps[read], group.turn_radps[read]
        by_speed, by_turn = group.factors(x)
        ahead = np.stack([np.cos(x[:, 2]), np.sin(x[:, 2]), np.zeros(m)], axis=1)
        right = np.stack([-ahead[:, 1], ahead[:, 0], np.zeros(m)], axis=1)
        velocity = (speed * by_speed)[:, None] * ahead
        place = np.concatenate([x[:, :2], np.zeros((m, 1))], axis=1)
        heading = x[:, 2].copy()
        by_state, by_heading = np.zeros((m, 3, n)), np.zeros((m, n))
        by_state[:, 0, 0] = by_state[:, 1, 1] = 1.0
        by_heading[:, 2] = 1.0
        if "mount_rad" in at:
            heading += x[:, at["mount_rad"]]
            by_heading[:, at["mount_rad"]] = 1.0
        if late_s is not None:
            place, heading = place - late_s[:, None] * velocity, heading - late_s * turn * by_turn
            by_state[:, :, 2] = -late_s[:, None] * (speed * by_speed)[:, None] * right
            if "speed_scale" in at:
                by_state[:, :, at["speed_scale"]] = (late_s * speed)[:, None] * ahead
            if "turn_scale" in at:
                by_heading[:, at["turn_scale"]] = late_s * turn
            if self.lag >= 0:
                by_heading[:, self.lag] = -turn * by_turn
        if phi is not None:
            by_state, by_heading = by_state @ phi, (by_heading[:, None, :] @ phi)[:, 0]
        return Sight(place, by_state, velocity, heading, by_heading)

    def errors(self, x: FloatArray, rows: slice, is_peer: FloatArray) -> RangeErrors:
        """Return what the cameras add to their ranges: bias, scale, bias of a peer's marker."""
        at, m = self._group.at, len(x)
        bias, by_state = np.zeros(m), np.zeros_like(x)
        for name, share in (("range_bias_m", np.ones(m)), ("marker_bias_m", is_peer)):
            if name in at:
                bias += x[:, at[name]] * share
                by_state[:, at[name]] = share
        scale = at.get("range_scale", -1)
        return RangeErrors(bias, by_state, x[:, scale] if scale >= 0 else np.zeros(m), scale)
