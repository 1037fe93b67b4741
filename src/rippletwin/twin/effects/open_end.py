"""Radiation impedance of an open end, which effects at the load and at holes share.

Without a flange the sound goes into the full space, with one into half of it: the same flow out of
the end then meets twice the pressure in phase with it. For long waves, k r << 1 with the radius r,

    unflanged   Re Z_r = Zc (k r)^2/4,  delta = 0.6133 r    Levine & Schwinger 1948
    flanged     Re Z_r = Zc (k r)^2/2,  delta = 0.8217 r    Rayleigh 1896; Norris & Sheng 1989

Between the two, for a flange of finite width, both are taken as going in proportion.
"""

from __future__ import annotations

import numpy as np

UNFLANGED, FLANGED = 0.6133, 0.8217  # end correction over the radius


def reflection_loss(end_correction):
    """b in |R| = 1/(1 + b (k r)^2) of an end of that `end_correction` (radii): 1/2 without a
    flange, 1 with an infinite one, since (1 - |R|^2)/4 is Re Z_r/Zc at low frequency."""
    flange = np.clip((end_correction - UNFLANGED) / (FLANGED - UNFLANGED), 0.0, 1.0)
    return 0.5 + 0.5 * flange


def radiation_impedance(s, diameter, wave_speed, density, end_correction):
    """Z_r = Zc (1 + R)/(1 - R), Pa s/m3, of an open end of that `end_correction` in radii.

    R = -exp(-2 s delta/a)/(1 + b (k r)^2), with `reflection_loss` b, is right to second order in
    k r and never larger than 1: passive (the form of Silva et al. 2009, J. Sound Vib. 322:255, cut
    off there).
    """
    radius = 0.5 * diameter
    k2 = np.abs(s * radius / wave_speed) ** 2
    phase = np.exp(-2.0 * s * end_correction * radius / wave_speed)
    reflection = -phase / (1.0 + reflection_loss(end_correction) * k2)
    characteristic = density * wave_speed / (np.pi * radius**2)
    return characteristic * (1.0 + reflection) / (1.0 - reflection)
