"""Errors of readings and of the source that explain them, as explaining takes them.

The readings are d = S h + e. h is what the line makes of a nominal source, and S is the factor by
which the real source differs from it. e is noise with a covariance C and a relative model error
delta common to all sensors. At each frequency

    S = exp(eps) (1 + g w),

with two errors. w differs from harmonic to harmonic, with standard deviation sigma. eps is smooth
in frequency, as unstated relief grooves or free air, a wrong bulk modulus or port timing make it.
It is complex: an error of amplitude and of phase. Between frequencies f and f' of recordings o and
p its covariance is

    tau^2 [1 + (1 + f f'/f0^2) exp(-(f - f')^2/(2 l^2))] (1/2 + 1/2 [o = p]) + s^2, f0 = l = 1 kHz.

* One part is the same at all frequencies: the size of the ripple may be wrong.
* One part grows with frequency: an error of timing is an error of phase, and edges of ports that
  are less sharp than stated take most from the highest harmonics.
* Half of both is common to all operating points: the same pump is modelled wrongly.

eps stands in an exponent because a source is often several times smaller than the nominal one. Were
it a normal error of the nominal source, that would have to be large to allow for it, and the
likeliest line would be the one that makes of the nominal source the least ripple: with a pump's
volume that is too large, and a pipe before it that is too short.

A smooth error resembles an effect at the pump, friction or a hose. Without tau the standard
deviations of those effects would be several times too small, and an effect at the pump would be
named where only the ripple is wrong.

The residual determines tau, with one exception. An error of the ripple's size that is common to all
operating points is absorbed by the impedance of the line, all segments alike: displacement fixes
the mean flow, but not the backflow, which makes most of a ripple and goes with the bulk modulus. So
a size common to all is uncertain by s = 3 % whatever tau is. Without s the stated standard
deviations of the impedances would be several times too small. Where the bulk modulus is a parameter
of its own, s = 1 % is left for dead volumes, ports and leakage.

g >= 1 is the size of the nominal ripple around a harmonic over that of the harmonic itself. Where
two parts of the ripple cancel, or 40 dB below the strongest harmonic, a few per cent of the parts
are a large part of the sum.

n is the mean square over the sensors of what an orifice's products of harmonics contribute to the
prediction. They are wrong by lambda, several times more than the harmonics themselves, and come
from the load and not along h.

S is expanded about the most likely smooth error, S = mean + factor (eps + g w), so that eps and w
are integrated out in closed form:

    d - mean h ~ N(0, C + (delta^2 m + lambda^2 n) I + (sigma^2 g^2 I + K) o p p^H),   p = factor h.

m is the mean square of the measured harmonic over the sensors, K the covariance of eps. The smooth
source and this covariance are held where the errors were estimated last, and a descent
estimates them after each step: iteratively reweighted least squares (Green 1984, J. R. Stat. Soc. B
46:149). A descent that could change the covariance would make the prediction small,
because that makes the errors of its source small. Explaining adds a least delta and the choice to
be source-free: sigma is infinite, which projects amplitude and phase of the source out at every
frequency. All observations stand side by side.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from rippletwin.calibration.error_costs import error_costs
from rippletwin.calibration.error_sizes import ErrorSizes, find_most_likely_sizes
from rippletwin.calibration.smooth_source import SmoothSourceError, SourceExpansion
from rippletwin.calibration.source_expansion import (
    SourceData,
    find_most_likely_expansion,
    whiten_with_source,
)
from rippletwin.calibration.whitening import TINY, NoiseBasis, Whitening, best_amplitude

FIRST_SOURCE_SD = 0.03  # before any residual is known
FIRST_SIZES = ErrorSizes(smooth=0.0, source=FIRST_SOURCE_SD, model=0.1)
SIZE_SD, SIZE_SD_OF_PUMP = 0.03, 0.01  # s, and s where the pump's numbers are parameters
SOURCE_STEPS = 8  # at most, towards the most likely smooth error


class Sources(NamedTuple):
    """What is known of the source at each frequency beforehand.

    known, free   (F,) masks; at all other frequencies it is nominal
    scale         (F,) g
    smooth        the smooth error of nominal ones
    """

    known: np.ndarray
    free: np.ndarray
    scale: np.ndarray
    smooth: SmoothSourceError

    @property
    def independent(self) -> np.ndarray:
        """(F,) by which sigma is multiplied: nothing is unknown of a known source, all of a free
        one."""
        return np.where(self.known, 0.0, np.where(self.free, np.inf, self.scale))


class _Held(NamedTuple):
    """What a descent does not change between two estimates of the errors.

    prediction   (S, F): the covariance is that of it
    source       (F,) the most likely source over the nominal one, with its smooth error alone
    offset       (S, F): expected readings less source times prediction
    """

    prediction: np.ndarray
    source: np.ndarray
    offset: np.ndarray


class ReadingErrors:
    """Errors of readings (S, F), and the most likely source, given predictions h (S, F).

    All arrays are in a basis in which the noise is diagonal (`NoiseBasis`).

    values     (S, F) readings
    power      (F,) m
    variances  (S, F) of the noise
    products   (F,) lambda^2 n, or 0
    sizes      tau, sigma and delta, set by `estimate`
    """

    def __init__(self, values: np.ndarray, power: np.ndarray, noise: NoiseBasis, sources: Sources):
        self.values, self.power, self.variances = values, power, noise.variances
        self.products: np.ndarray | float = 0.0
        self.sizes = FIRST_SIZES
        self._sources, self._smooth = sources, sources.smooth
        self._independent = sources.independent
        self._expansion = self._smooth.without_error()
        self._held: _Held | None = None
        self._kept: tuple[ErrorSizes, Whitening] | None = None  # whitening at some sizes

    def with_values(self, values: np.ndarray, power: np.ndarray) -> ReadingErrors:
        """The same errors of other readings (S, F) with mean squares `power` (F,)."""
        other = copy(self)
        other.values, other.power, other._kept = values, power, None
        return other

    def whitening(self, h: np.ndarray) -> Whitening:
        """Whitening by the covariance that is held, or before any estimate by that of h (S, F)."""
        if self._held is None:
            return whiten_with_source(self._source_data(h), self._expansion)
        if self._kept is None or self._kept[0] != self.sizes:
            data = self._source_data(self._held.prediction)
            self._kept = self.sizes, whiten_with_source(data, self._expansion)
        return self._kept[1]

    def residual(self, h: np.ndarray) -> np.ndarray:
        """Readings less the expected ones, in their unit, for predictions h; both (..., S, F)."""
        if self._held is None:
            return self.values - self._expansion.mean * h
        return self.values - self._held.offset - self._held.source * h

    def variance(self) -> np.ndarray:
        """Variance (S, F) of the readings, their unit squared, without the share of the source."""
        return self.variances + self.products + self.sizes.model**2 * self.power

    def smooth_source(self, h: np.ndarray) -> np.ndarray:
        """Most likely source (F,) over the nominal one, without its independent error, for
        predictions h (S, F)."""
        if self._held is not None:
            return self._held.source
        return self._source(h, independent=False)

    def most_likely_source(self, h: np.ndarray) -> np.ndarray:
        """Most likely source (F,) over the nominal one, for predictions h (S, F)."""
        return self._source(h, independent=True)

    def free_amplitudes(self, h: np.ndarray) -> np.ndarray:
        """Most likely amplitude (F,) of a free source, 1 of any other."""
        return self._with_free_amplitudes(np.ones(len(self.power)), h)

    def draw_source(self, normal) -> np.ndarray:
        """Factor (F,) drawn for the nominal source; `normal(N)` draws N complex unit normals."""
        nominal = ~(self._sources.known | self._sources.free)
        sds = self._smooth.sds(self.sizes.smooth)
        smooth = self._smooth.expand(sds * normal(len(sds)))
        independent = np.where(nominal, self.sizes.source * self._sources.scale, 0.0)
        return smooth.factor * (1.0 + independent * normal(len(nominal)))

    def estimate(self, h: np.ndarray, scale: float, near: bool, max_model_error: float) -> None:
        """Set the sizes and the smooth error to their most likely values, and hold them.

        h       (S, F) predictions
        scale   of the sum of squares, for the degrees of freedom that parameters take
        near    whether to go on from the present values
        """
        self._held = self._kept = None
        if near:
            self._settle(h, scale)
        else:
            self._choose(h, scale)
        self.sizes = self.sizes._replace(model=min(self.sizes.model, max_model_error))
        self._hold(h)

    def follow(self, h: np.ndarray) -> None:
        """Move the smooth error to its most likely value at predictions h (S, F), and hold it: the
        sizes stay. Nothing before the first estimate."""
        if self._held is not None:
            self._held = self._kept = None
            self._expand(h)
            self._hold(h)

    def make_independent(self, h: np.ndarray) -> None:
        """Add the smooth part of the source's error and that of its size to the independent part,
        at h (S, F)."""
        parts = self.sizes.source, self.sizes.smooth, self._smooth.size_sd
        total = float(np.linalg.norm(parts))
        self._smooth = self._smooth.without_size()
        self.sizes = ErrorSizes(0.0, total, self.sizes.model)
        self._expansion = self._smooth.without_error()
        self._hold(h)

    def _hold(self, h: np.ndarray) -> None:
        """Hold source and covariance of a prediction."""
        self._held = self._kept = None
        source = self._source(h, independent=False)
        self._held = _Held(h, source, (self._expansion.mean - source) * h)

    def _choose(self, h: np.ndarray, scale: float) -> None:
        """Settle the errors from a source without a smooth error, and from what the readings alone
        suggest of it; the likelier ones are kept."""
        starts = [self._smooth.without_error()]
        if len(self._smooth.frequencies):
            starts.append(self._expansion_by_readings(h))
        found = []
        for start in starts:
            self._expansion = start
            self._estimate_sizes(h, scale, near=False)
            self._expand(h)
            self._estimate_sizes(h, scale, near=True)
            self._settle(h, scale)
            whitening = self.whitening(h)
            square = float(np.sum(np.abs(whitening.apply(self.residual(h))) ** 2))
            cost = scale * square + whitening.log_determinant
            found.append((cost, self._expansion, self.sizes))
        _, self._expansion, self.sizes = min(found, key=lambda each: each[0])

    def _settle(self, h: np.ndarray, scale: float) -> None:
        """Move the smooth error, and then the sizes, to their most likely values nearby. In this
        order: an error that belongs to another prediction would make all sizes large."""
        self._expand(h)
        self._estimate_sizes(h, scale, near=True)

    def _expansion_by_readings(self, h: np.ndarray) -> SourceExpansion:
        """The expansion about the smooth part of the source that the readings alone suggest."""
        size = np.sum(np.abs(h) ** 2 / self.variance(), axis=0)
        ratio = best_amplitude(self.values, h, self.variance())
        return self._smooth.expand_near(ratio, 1.0 / np.maximum(size * np.abs(ratio) ** 2, TINY))

    def _expand(self, h: np.ndarray) -> None:
        """Move the expansion to the most likely smooth error."""
        if len(self._smooth.frequencies) and self.sizes.smooth > 0.0:
            data = self._source_data(h)
            self._expansion = find_most_likely_expansion(data, self._expansion, SOURCE_STEPS)

    def _estimate_sizes(self, h: np.ndarray, scale: float, near: bool) -> None:
        """Set the sizes to their most likely values at the present expansion."""
        residual = self.residual(h)

        def costs(grids):
            taus, sds, model_errors = grids
            return error_costs(
                residual,
                h * self._expansion.factor,
                self.variances + self.products,
                self.power,
                self._independent,
                self._smooth.frequencies,
                self._smooth.basis,
                model_errors,
                sds,
                self._smooth.sds(taus),
                scale,
            )

        any_nominal = len(self._smooth.frequencies) > 0
        self.sizes = find_most_likely_sizes(costs, self.sizes, any_nominal, near)

    def _source_data(self, h: np.ndarray) -> SourceData:
        return SourceData(
            self.values,
            h,
            np.sqrt(self.variance()),
            self.sizes.source * self._independent,
            self._smooth,
            self.sizes.smooth,
        )

    def _source(self, h: np.ndarray, independent: bool) -> np.ndarray:
        """Most likely source (F,), with or without its independent error."""
        whitening, expansion = self.whitening(h), self._expansion
        pull = whitening.pull(h * expansion.factor, self.residual(h))
        error = self._smooth.error(self._smooth.most_likely(pull, self.sizes.smooth))
        if independent:
            sd = np.where(self._sources.known, 0.0, self.sizes.source * self._sources.scale)
            error += sd**2 * pull
        return self._with_free_amplitudes(expansion.mean + expansion.factor * error, h)

    def _with_free_amplitudes(self, source: np.ndarray, h: np.ndarray) -> np.ndarray:
        if not self._sources.free.any():
            return source
        return np.where(self._sources.free, best_amplitude(self.values, h, self.variance()), source)
