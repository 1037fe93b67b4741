"""The twin: a rig with uncertain numbers that predicts what its sensors read.

Interfaces (implementation follows):

Twin(rig, observations, friction="steady", effects=(), source_sd=0.02, theta=None)
    .parameters : tuple[Parameter]      names: wave_speed[i], diameter[i], length[i] (i from 1),
                                        position[NAME], viscosity, load, angle[r] (r from 1),
                                        then each effect's own, named EFFECT.PARAMETER
    .values(theta) -> dict              physical values by name
    .predict(observations, theta) -> list of (S, F) complex   (an input_impedance gives R, see below)
    .network(observation, theta) -> Network    ready to be asked for pressures, effects applied
    .to_dict(), Twin.from_dict(d, observations)

theta is in the coordinates of rippletwin.parameters: 0 is nominal, priors are N(0, 1).

An effect, as the twin calls it (any object with these):
    effect.name : str
    effect.parameters : tuple[Parameter, ...]      names without the effect's own name
    effect.apply(network, values, setting) -> None
        network : line.chain.Network to change: (F,) columns at the frequencies of ALL recordings
        values  : dict of this effect's physical values by name
        setting : Setting(fluid, diameter (n,), wave_speed (n,), length (n,), friction, sensors,
                  recording (F,) int, order (F,), speed_hz (F,)): the twin's values at this theta

calibrate.calibrate(twin, observations, settings=Settings()) -> Calibration
Calibration: twin, theta, covariance (P, P), pull (P,), warnings, misfit, theil, floor, ...
"""
