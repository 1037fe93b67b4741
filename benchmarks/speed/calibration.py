"""Calibration, against global searches with the method of characteristics as their model."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
from scipy.optimize import differential_evolution
from scipy.signal import resample

from rippletwin.calibration.calibrate import calibrate
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.pareto import BOX, sensor_misfits
from rippletwin.calibration.shaft_angles import align_shaft_angles
from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.line.time_domain.method_of_characteristics import simulate, steps_a_period
from rippletwin.spectra.observation import Observation
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.propagation import line_in_time
from rippletwin.twin.twin import Twin
from selfcheck_cases import REVOLUTIONS, SAMPLES, kinematic_ripple
from speed.result import Claim, Result, Table
from speed.timing import alternate, in_words

SHAFT_HZ, PRESSURE, NOISE = 1000 / 60, 9.5e6, 1e3  # Hz, Pa, Pa
HIGHEST_HZ, SAMPLING_HZ = 4000.0, 51200.0
TOLERANCE = 1e-3  # of the characteristics' periodicity
SAME = 1.1  # misfits count as the same up to this factor
ROUGH = 0.01  # a misfit that is easier to reach
MOST_EVALUATIONS = 30_000  # of a search
RIG = Rig(
    Fluid(870.0, 3.2e-5),
    {"pistons": 9},
    (
        Segment(5.953, 0.01971, 1022.9),
        Segment(1.144, 0.02307, 982.7),
        Segment(1.675, 0.01486, 1308.4),
    ),
    (Sensor("p1", 0.4167), Sensor("p2", 2.5895)),
    Load("orifice"),
)


def recorded(seed: int = 0) -> list[Observation]:
    """One operating point of a line drawn from the priors, with sensor noise."""
    rng = np.random.default_rng(seed)
    orders = 9 * np.arange(1, int(HIGHEST_HZ / (9 * SHAFT_HZ)) + 1)
    count = len(RIG.sensors)
    variance = 4 * NOISE**2 / (SAMPLES * REVOLUTIONS)
    blank = Observation(
        "periodic",
        "point",
        orders * SHAFT_HZ,
        orders,
        np.ones((count, len(orders)), complex),
        np.tile(np.eye(count, dtype=complex) * variance, (len(orders), 1, 1)),
        np.full(count, PRESSURE),
        SHAFT_HZ,
        PRESSURE,
        "nominal",
        kinematic_ripple(SHAFT_HZ, PRESSURE),
        RIG.sensors,
    )
    twin = Twin(RIG, [blank])
    theta = np.clip(rng.normal(size=len(twin.theta)), -2, 2)
    clean = ForwardModel(twin, [blank])(theta)[0]
    error = rng.normal(size=(*clean.shape, 2)) @ np.array([1, 1j]) * np.sqrt(variance / 2)
    return [Observation(**vars(blank) | {"values": clean + error})]


class Search:
    """The misfit as a global search sees it: without the shaft angle, which is aligned.

    The search runs on our frequency-domain model, which answers as characteristics do, and its
    evaluations are counted: with characteristics they would take hours.
    """

    def __init__(self, observations):
        self.twin = Twin(RIG, observations)
        self.model = Likelihood(self.twin, observations)
        self.searched = np.array([not p.flat for p in self.twin.parameters])
        self.evaluations, self.best = 0, np.inf
        self.first: dict[float, int] = {}  # misfit -> evaluations until it was reached
        self.goal = 0.0

    def misfits(self, x: np.ndarray) -> np.ndarray:
        """Squared misfit (S,) of each sensor at x (the searched coordinates)."""
        theta = np.zeros(len(self.searched))
        theta[self.searched] = x
        theta = align_shaft_angles(self.model, theta, between=True)[1]
        found = sensor_misfits(self.model, theta)
        self.evaluations += 1
        self.best = min(self.best, float(np.sqrt(found.mean())))
        for goal in (ROUGH, SAME * self.goal):
            if self.best <= goal:
                self.first.setdefault(goal, self.evaluations)
        return found

    @property
    def reached(self) -> int | None:
        """Evaluations until the goal, None where it was not reached."""
        return self.first.get(SAME * self.goal)

    @property
    def over(self) -> bool:
        return self.reached is not None or self.evaluations >= MOST_EVALUATIONS


def evolve(search: Search, most: int) -> None:
    """SciPy's differential evolution with its defaults, until the goal or `most` evaluations."""

    def stop(*_, **__):
        return search.over or search.evaluations >= most

    dimensions = int(search.searched.sum())
    differential_evolution(
        lambda x: float(search.misfits(x).sum()),
        [(-BOX, BOX)] * dimensions,
        callback=stop,
        maxiter=10**6,
        rng=0,
        polish=False,
        tol=0.0,
    )


def nsga(search: Search, most: int) -> None:
    """pymoo's NSGA-II with a population of 60, one objective a sensor, until the same."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem

    class Problem(ElementwiseProblem):
        def __init__(self):
            count = int(search.searched.sum())
            super().__init__(n_var=count, n_obj=len(RIG.sensors), xl=-BOX, xu=BOX)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = search.misfits(x)

    algorithm = NSGA2(pop_size=60)
    algorithm.setup(Problem(), seed=0, verbose=False)
    while not search.over and search.evaluations < most:
        algorithm.next()


def by_characteristics(twin: Twin, observation) -> np.ndarray:
    """The readings' harmonics (S, F) as a search by characteristics calculates them."""
    ripple = observation.flow_ripple
    line = line_in_time(twin, ripple.flow, ripple.flow, SHAFT_HZ, PRESSURE)
    steps = steps_a_period(line.pipes, line.period, int(SAMPLING_HZ / SHAFT_HZ))
    line.flow = resample(line.flow, steps)
    return simulate(line, 60, TOLERANCE).harmonics(observation.orders)


def run(quick: bool = False) -> Result:
    """Times to the same misfit."""
    observations = recorded()
    most = 400 if quick else MOST_EVALUATIONS
    ours = calibrate(Twin(RIG, observations), observations)
    goal = ours.after.relative
    exact = ForwardModel(ours.twin, observations)(ours.twin.theta)[0]
    turned = ours.twin.theta.copy()
    turned[[p.flat for p in ours.twin.parameters]] = 0.0
    in_time = by_characteristics(ours.twin, observations[0])
    straight = ForwardModel(ours.twin, observations)(turned)[0]
    differs = np.linalg.norm(in_time - straight) / np.linalg.norm(straight)
    times = alternate(
        {
            "calibrate": lambda: calibrate(Twin(RIG, observations), observations),
            "evaluation": lambda: by_characteristics(ours.twin, observations[0]),
        },
        1 if quick else 5,
    )
    middle = {name: float(np.median(values)) for name, values in times.items()}
    rows = [
        [
            "rippletwin calibrate",
            in_words(middle["calibrate"]),
            "measured",
            f"{100 * goal:.3g} %",
            f"below {in_words(middle['calibrate'])}",
        ]
    ]
    searches = {"differential evolution (SciPy)": evolve}
    notes = []
    if find_spec("pymoo"):
        searches["NSGA-II (pymoo)"] = nsga
    else:
        notes.append("pymoo is not installed.")
    claims = [
        Claim("calibrate: three segments, two sensors, one point", middle["calibrate"], 0.3, "s",
              at_least=False)
    ]  # fmt: skip
    for name, start in searches.items():
        search = Search(observations)
        search.goal = np.sqrt(sensor_misfits(search.model, ours.twin.theta).mean())
        start(search, most)
        count = search.reached or search.evaluations
        seconds = count * middle["evaluation"]
        claims.append(
            Claim(
                f"{name} over characteristics: time over calibrate's",
                seconds / middle["calibrate"],
                1000.0,
                note=f"{count} evaluations counted, times the measured time of one"
                + ("" if search.reached else "; a lower bound: the misfit was not reached"),
            )
        )
        rough = search.first.get(ROUGH)
        rows.append(
            [
                f"{name}, {count} evaluations",
                in_words(seconds),
                "extrapolated",
                f"{100 * search.best:.3g} %",
                in_words(rough * middle["evaluation"]) if rough else "not reached",
            ]
        )
    columns = ["method", "time", "", "misfit reached", "time to 1 % misfit"]
    agree = f"Characteristics and the frequency domain differ by {100 * differs:.2f} %."
    return Result(
        point=3,
        title="Calibration",
        what=[
            "A line of three segments drawn from the priors, two sensors, one operating point, "
            f"harmonics below {HIGHEST_HZ:.0f} Hz, sensor noise. All fit the same parameters "
            "within three standard deviations of the data sheet.",
            "The peers' model is the method of characteristics at 51.2 kHz until it is periodic. "
            "Their times are **extrapolated**: the evaluations are counted in a search on our "
            "frequency-domain model, which answers the same, and multiplied by the measured time "
            f"of one simulation ({in_words(middle['evaluation'])}).",
        ],
        claims=claims,
        tables=[Table("Time to the misfit", columns, rows)],
        bound=bound(observations, middle["calibrate"], exact.shape[1]),
        notes=[agree, *notes],
    )


def bound(observations, seconds: float, frequencies: int) -> list[str]:
    """How many solutions of the line a calibration's time would hold."""
    twin = Twin(RIG, observations)
    forward = ForwardModel(twin, observations)
    one = float(np.median(alternate({"one": lambda: forward(twin.theta)}, 5)["one"]))
    return [
        f"One solution of the line at {frequencies} frequencies takes {in_words(one)} by "
        f"itself, so that a calibration lasts as long as {seconds / one:.0f} of them. It makes "
        "several descents through three frequency limits, and needs a derivative for each of "
        f"{len(twin.theta)} parameters at each step."
    ]
