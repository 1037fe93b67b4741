"""How many workers keep up with the jobs of many pumps.

    python benchmarks/queue_of_pumps.py costs.json --measure CASE
    python benchmarks/queue_of_pumps.py costs.json [--pumps 10000] [--every 60] [--workers 40 80]

The first line runs check, explain, diagnose and report on a case, each three times on one thread,
and writes to costs.json what they take in processor time and what they leave on the disk. The
second one draws the jobs of a week from these times: a diagnosis of each pump every so many
minutes, an explanation every so many days, both at random moments, more of them at the peak of the
day. Each worker is one core; it serves the oldest job, and is killed now and then, after which its
job begins anew at the end of the queue. A table says for each number of workers how loaded they
are, how long jobs wait and how many are left; the last line is the smallest number that keeps up.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fleet.many_servers import DAY, Served, draw_arrivals, serve

KINDS = ("diagnose", "explain")
AROUND = (0.9, 1.0, 1.1, 1.25, 1.5)  # numbers of workers shown, of the mean load
MOMENTS = 10_000  # at which the queue is counted


@dataclass(frozen=True)
class Demand:
    """Jobs of some days: when each comes and how long it takes, s, both (n,)."""

    arrival: np.ndarray
    service: np.ndarray
    duration: float  # s

    @property
    def mean_load(self) -> float:
        """Cores that the jobs occupy on average, none of them killed."""
        return float(self.service.sum() / self.duration)


@dataclass(frozen=True)
class Row:
    """What a number of workers makes of a demand; waits in s, of the jobs after the first day."""

    workers: int
    load: float  # work to be done, with what is lost to kills, over what the workers can do
    median: float
    p95: float
    most: int  # jobs waiting, the largest number
    left: int  # jobs waiting at the end
    keeps_up: bool


def draw_demand(
    seconds: dict[str, list[float]], rates: dict[str, float], days: float, peak: float, seed: int
) -> Demand:
    """Jobs of each kind: `rates` (1/s) of them, each as long as one of its `seconds`."""
    rng = np.random.default_rng(seed)
    duration = days * DAY
    arrivals = [draw_arrivals(rates[kind], duration, peak, rng) for kind in rates]
    services = [
        rng.choice(seconds[kind], len(arrival))
        for kind, arrival in zip(rates, arrivals, strict=True)
    ]
    arrival, service = np.concatenate(arrivals), np.concatenate(services)
    order = np.argsort(arrival, kind="stable")
    return Demand(arrival[order], service[order], duration)


def try_workers(
    demand: Demand, workers: int, within: float, kill_rate: float = 0.0, seed: int = 0
) -> Row:
    """Serve the demand. The workers keep up where they can do more than there is to do, and 95 % of
    the jobs after the first day wait for `within` (s) at most."""
    rng = np.random.default_rng(seed)
    served: Served = serve(demand.arrival, demand.service, workers, kill_rate, rng)
    wait = served.wait[demand.arrival >= DAY]
    median, p95 = np.quantile(wait, [0.5, 0.95])
    load = served.busy / (workers * demand.duration)
    waiting = served.waiting(np.linspace(0.0, demand.duration, MOMENTS))
    return Row(
        workers=workers,
        load=load,
        median=float(median),
        p95=float(p95),
        most=int(waiting.max()),
        left=int(waiting[-1]),
        keeps_up=bool(load < 1.0 and p95 <= within),
    )


def smallest(demand: Demand, within: float, kill_rate: float = 0.0, seed: int = 0) -> Row:
    """The smallest number of workers that keeps up, by bisection."""

    def tried(workers: int) -> Row:
        return try_workers(demand, workers, within, kill_rate, seed)

    below, above = 0, max(int(np.ceil(demand.mean_load)), 1)
    while not (row := tried(above)).keeps_up:
        below, above = above, 2 * above
    while above - below > 1:
        middle = (below + above) // 2
        if (one := tried(middle)).keeps_up:
            above, row = middle, one
        else:
            below = middle
    return row


def read_seconds(path: Path) -> dict[str, list[float]]:
    """Processor seconds of each run of each kind of job; raises ValueError in one line."""
    try:
        jobs = json.loads(path.read_text("utf-8"))["jobs"]
        seconds = {kind: [float(run["cpu_s"]) for run in jobs[kind]] for kind in KINDS}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise ValueError(f"{path}: no costs of jobs ({error!r}). Write it with --measure") from None
    for kind, runs in seconds.items():
        if not runs or min(runs) <= 0.0:
            raise ValueError(f"{path}: jobs.{kind}: cpu_s must be above 0. Write it with --measure")
    return seconds


def show(demand: Demand, rows: list[Row]) -> str:
    """A table of the rows, in minutes."""
    head = (
        f"{'workers':>8} {'load':>6} {'median wait':>12} {'95 % wait':>12} {'most':>7} {'left':>7}"
    )
    lines = [f"{demand.mean_load:.1f} cores are at work on average; waits in minutes", head]
    for row in rows:
        lines.append(
            f"{row.workers:>8} {row.load:>6.2f} {row.median / 60:>12.1f} {row.p95 / 60:>12.1f} "
            f"{row.most:>7} {row.left:>7}{'' if row.keeps_up else '  falls behind'}"
        )
    return "\n".join(lines)


def write_costs(path: Path, case: Path, repeats: int) -> dict:
    """Measure the jobs of a case; what is written and returned names the machine too."""
    from fleet.job_costs import measure
    from speed.machine import describe

    machine = describe()
    with TemporaryDirectory() as folder:
        costs = {
            "machine": f"{machine['processor']}, Python {machine['python']}",
            **measure(case, Path(folder), repeats),
        }
    path.write_text(json.dumps(costs, indent=1) + "\n")
    return costs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("costs", type=Path, metavar="costs.json")
    parser.add_argument("--measure", type=Path, metavar="CASE", help="write costs.json first")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each command that count")
    parser.add_argument("--pumps", type=int, default=10_000)
    parser.add_argument("--every", type=float, default=60.0, help="minutes between diagnoses")
    parser.add_argument("--explain", type=float, default=365.0, help="days between explanations")
    parser.add_argument(
        "--peak", type=float, default=1.5, help="largest rate over the mean, 1 to 2"
    )
    parser.add_argument("--killed", type=float, default=24.0, help="hours of work between kills")
    parser.add_argument(
        "--within", type=float, help="minutes that 95 %% may wait; by default EVERY"
    )
    parser.add_argument("--workers", type=int, nargs="+")
    parser.add_argument("--days", type=float, default=7.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in ("repeats", "pumps", "every", "explain", "killed", "within"):
        if (value := getattr(options, name)) is not None and value <= 0:
            parser.error(f"--{name}: {value} must be above 0")
    if not 1.0 <= options.peak <= 2.0:
        parser.error(f"--peak: {options.peak} must be from 1 to 2")
    if options.days <= 1.0:
        parser.error(f"--days: {options.days} must be above 1: the first day does not count")
    if options.workers and min(options.workers) < 1:
        parser.error("--workers: each must be 1 or more")

    if options.measure:
        print(json.dumps(write_costs(options.costs, options.measure, options.repeats), indent=1))
        return
    try:
        seconds = read_seconds(options.costs)
    except ValueError as error:
        parser.error(str(error))
    rates = {
        "diagnose": options.pumps / (60 * options.every),
        "explain": options.pumps / (DAY * options.explain),
    }
    demand = draw_demand(seconds, rates, options.days, options.peak, options.seed)
    within = 60 * (options.within or options.every)
    kill_rate = 1 / (3600 * options.killed)
    least = smallest(demand, within, kill_rate, options.seed)
    around = {max(round(factor * demand.mean_load), 1) for factor in AROUND}
    rows = {least.workers: least}
    for workers in set(options.workers or around) - {least.workers}:
        rows[workers] = try_workers(demand, workers, within, kill_rate, options.seed)
    print(show(demand, [rows[workers] for workers in sorted(rows)]))
    print(f"{least.workers} workers keep up: 95 % of the jobs wait {within / 60:g} min at most")


if __name__ == "__main__":
    main()
