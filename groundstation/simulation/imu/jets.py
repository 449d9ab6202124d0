"""Jets: values of functions of time with their exact derivatives, by Taylor coefficients."""

from collections.abc import Sequence
from math import factorial, sqrt
from typing import Union

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

FloatArray = NDArray[np.float64]
Term = Union["Jet", FloatArray, float]
FAR = 7.0  # erf is 1 to the last bit from here on, and the bell 0


@dataclass(frozen=True, eq=False)
class Jet:
    """Taylor coefficients of a function at n times.

    They are the value, the first derivative, half the second and so on. Two jets give one of the shorter's order.

    Source: Griewank and Walther, Evaluating Derivatives, 2nd ed. 2008, section 13.2.

    Examples
    --------
    >>> time = Jet.of_time(np.array([2.0]), 3)
    >>> [float(one[0]) for one in (time * time * time).taylor]
    [8.0, 12.0, 6.0, 1.0]
    """

    taylor: tuple[FloatArray, ...]

    @classmethod
    def of_time(cls, time_s: FloatArray, order: int) -> "Jet":
        """Return time itself as a jet."""
        zero = np.zeros_like(time_s)
        return cls((time_s, np.ones_like(time_s), *(zero for _ in range(order - 1))))

    @property
    def value(self) -> FloatArray:
        """Values, shape (n,)."""
        return self.taylor[0]

    @property
    def rate(self) -> FloatArray:
        """First derivatives, shape (n,)."""
        return self.taylor[1]

    def derivative(self) -> "Jet":
        """Return the derivative, a jet of one order less."""
        return Jet(tuple(place * one for place, one in enumerate(self.taylor) if place))

    def __neg__(self) -> "Jet":
        return Jet(tuple(-one for one in self.taylor))

    def __add__(self, other: Term) -> "Jet":
        if isinstance(other, Jet):
            return Jet(tuple(one + two for one, two in zip(self.taylor, other.taylor, strict=False)))
        return Jet((self.taylor[0] + other, *self.taylor[1:]))

    def __sub__(self, other: Term) -> "Jet":
        return self + (-other)

    def __mul__(self, other: Term) -> "Jet":
        if not isinstance(other, Jet):
            return Jet(tuple(one * other for one in self.taylor))
        a, b = self.taylor, other.taylor
        return Jet(tuple(_sum([a[i] * b[k - i] for i in range(k + 1)]) for k in range(min(len(a), len(b)))))

    def __truediv__(self, other: Term) -> "Jet":
        if not isinstance(other, Jet):
            return self * (1.0 / other)
        a, b = self.taylor, other.taylor
        found: list[FloatArray] = []
        for k in range(min(len(a), len(b))):
            found.append((a[k] - _sum([b[i] * found[k - i] for i in range(1, k + 1)])) / b[0])
        return Jet(tuple(found))

    __radd__, __rmul__ = __add__, __mul__


def _sum(terms: Sequence[FloatArray]) -> FloatArray:
    total: FloatArray = np.zeros(())
    for one in terms:
        total = total + one
    return total


def composed(derivatives: Sequence[FloatArray], inner: Jet) -> Jet:
    """Return f(inner) by f and its derivatives at the values of the inner function."""
    order = min(len(derivatives), len(inner.taylor)) - 1
    step = Jet((np.zeros_like(inner.value), *inner.taylor[1 : order + 1]))
    found = step * 0.0 + derivatives[order] / factorial(order)
    for place in range(order - 1, -1, -1):
        found = found * step + derivatives[place] / factorial(place)
    return found


def sine(angle: Jet) -> Jet:
    """Sine of a jet, radians."""
    return _wave(angle, 0.0)


def cosine(angle: Jet) -> Jet:
    """Cosine of a jet, radians."""
    return _wave(angle, 1.0)


def _wave(angle: Jet, quarters: float) -> Jet:
    s, c = np.sin(angle.value), np.cos(angle.value)
    circle = (s, c, -s, -c) if quarters == 0.0 else (c, -s, -c, s)
    return composed([circle[place % 4] for place in range(len(angle.taylor))], angle)


def root(square: Jet) -> Jet:
    """Square root of a positive jet."""
    derivatives, power = [np.sqrt(square.value)], 0.5
    for _ in range(len(square.taylor) - 1):
        derivatives.append(derivatives[-1] * power / square.value)
        power -= 1.0
    return composed(derivatives, square)


def direction(across: Jet, along: Jet) -> Jet:
    """Angle of a vector that never vanishes, radians: arctan2(across, along)."""
    rate = along * across.derivative() - across * along.derivative()
    turning = rate / (along * along + across * across)
    value = np.arctan2(across.value, along.value)
    return Jet((value, *(one / (place + 1) for place, one in enumerate(turning.taylor))))


@dataclass(frozen=True)
class Ramps:
    """Sum of soft ramps: the slope rises by ``size`` about ``at`` within ``width``.

    F(u) = sum size / 2 (u - at + width I((u - at) / width)), I(x) = x erf(x) + exp(-x^2) / sqrt(pi). Every derivative
    is closed, and far from ``at`` it is flat to the last bit. ``slope`` gives steps: F'.
    """

    at: FloatArray
    width: FloatArray
    size: FloatArray

    def of(self, inner: Jet) -> Jet:
        """Return the ramps F(inner)."""
        return composed(self._derivatives(inner.value, 4), inner)

    def slope(self, inner: Jet) -> Jet:
        """Return the steps F'(inner)."""
        return composed(self._derivatives(inner.value, 5)[1:], inner)

    def _derivatives(self, u: FloatArray, count: int) -> list[FloatArray]:
        from scipy.special import erf

        found = [np.zeros_like(u) for _ in range(count)]
        if not u.size:
            return found
        low, high = float(u.min()), float(u.max())
        for at, width, size in zip(self.at, self.width, self.size, strict=True):
            if at > high + FAR * width:
                continue
            if at < low - FAR * width:
                found[0] += size * (u - at)
                found[1] += size
                continue
            x = (u - at) / width
            rise, bell = erf(x), np.exp(-x * x) / sqrt(np.pi)
            found[0] += 0.5 * size * width * (x + x * rise + bell)
            found[1] += 0.5 * size * (1.0 + rise)
            bell *= size / width
            hermite = (np.ones_like(x), -2.0 * x, 4.0 * x * x - 2.0)
            for place in range(2, count):
                found[place] += bell * hermite[place - 2] / width ** (place - 2)
        return found


@dataclass(frozen=True)
class Sines:
    """Sum of sines amplitude sin(rate u + phase)."""

    amplitude: FloatArray
    rate: FloatArray
    phase: FloatArray

    def of(self, inner: Jet) -> Jet:
        """Return the sum at the inner function."""
        return composed(self._derivatives(inner, 0), inner)

    def slope(self, inner: Jet) -> Jet:
        """Return the derivative of the sum by the inner function."""
        return composed(self._derivatives(inner, 1), inner)

    def _derivatives(self, inner: Jet, first: int) -> list[FloatArray]:
        found = [np.zeros_like(inner.value) for _ in inner.taylor]
        for amplitude, rate, phase in zip(self.amplitude, self.rate, self.phase, strict=True):
            angle = rate * inner.value + phase
            s, c = np.sin(angle), np.cos(angle)
            circle = (s, c, -s, -c)
            for place in range(len(found)):
                found[place] += amplitude * rate ** (place + first) * circle[(place + first) % 4]
        return found
