"""The queue of many pumps' jobs against exact results, and what counts as keeping up."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest

from fleet.job_costs import run_command, size
from fleet.many_servers import DAY, draw_arrivals, serve
from paths import ROOT
from queue_of_pumps import draw_demand, read_seconds, smallest, try_workers

JOBS = 400_000


def rng():
    return np.random.default_rng(3)


def steady_arrivals(rate, random):
    return draw_arrivals(rate, JOBS / rate, 1.0, random)


@pytest.mark.parametrize(("workers", "load"), [(1, 0.6), (3, 0.8), (20, 0.9)])
def test_share_that_waits_is_erlangs(workers, load):
    """M/M/c: the share of jobs that wait is Erlang's C, and their mean wait is the service time
    over c (1 - load). Independent of the simulation."""
    random = rng()
    arrival = steady_arrivals(load * workers, random)
    served = serve(arrival, random.exponential(1.0, len(arrival)), workers)
    offered = load * workers
    top = offered**workers / math.factorial(workers) / (1 - load)
    erlang = top / (sum(offered**k / math.factorial(k) for k in range(workers)) + top)
    waited = served.wait > 1e-6
    assert np.mean(waited) == pytest.approx(erlang, rel=0.03)
    assert np.mean(served.wait[waited]) == pytest.approx(1 / (workers * (1 - load)), rel=0.06)


def test_mean_wait_of_equal_jobs_is_pollaczeks():
    """M/D/1: the mean wait is load / (2 (1 - load)) service times, half of that of M/M/1."""
    for load in (0.3, 0.7):
        arrival = steady_arrivals(load, rng())
        wait = serve(arrival, np.ones(len(arrival)), 1).wait
        assert np.mean(wait) == pytest.approx(load / (2 * (1 - load)), rel=0.03)


def test_the_mean_queue_is_littles():
    """Jobs waiting, averaged over time, are the rate of arrivals times the mean wait."""
    random = rng()
    arrival = steady_arrivals(1.6, random)
    served = serve(arrival, random.exponential(1.0, len(arrival)), 2)
    waiting = served.waiting(np.linspace(0.0, arrival[-1], 200_000))
    assert np.mean(waiting) == pytest.approx(1.6 * np.mean(served.wait), rel=0.01)


def test_a_killed_job_costs_what_its_attempts_last():
    """A job of length s that begins anew after each kill (rate k) keeps workers busy for
    (exp(k s) - 1) / k on average, and each comes to its end."""
    arrival = steady_arrivals(0.3, rng())
    rate, length = 0.5, 1.0
    served = serve(arrival, np.full(len(arrival), length), 1, rate, rng())
    assert served.busy / len(arrival) == pytest.approx(np.expm1(rate * length) / rate, rel=0.01)
    attempts = len(served.begun) / len(arrival)
    assert attempts == pytest.approx(np.exp(rate * length), rel=0.01)
    assert np.all(np.diff(served.entered) >= 0) and np.all(np.diff(served.begun) >= 0)
    assert np.isfinite(served.wait).all()


def test_arrivals_swing_with_the_day():
    """The highest rate is `peak` times the mean, six hours into each day; the lowest is as far
    below it; the mean is the rate asked for."""
    arrival = draw_arrivals(2.0, 10 * DAY, 1.5, rng())
    assert len(arrival) == pytest.approx(20 * DAY, rel=0.005)
    hour = (arrival % DAY) // 3600
    of_hour = np.bincount(hour.astype(int), minlength=24) * 24 / len(arrival)
    assert of_hour.max() == pytest.approx(1.5, abs=0.02) and of_hour.argmax() in (5, 6)
    assert of_hour.min() == pytest.approx(0.5, abs=0.02)


def small_demand():
    seconds = {"diagnose": [30.0, 40.0], "explain": [300.0]}
    return draw_demand(seconds, {"diagnose": 0.1, "explain": 0.002}, 4.0, 1.5, 0)


def test_workers_keep_up_where_the_load_allows():
    """Demand of 0.1 x 35 + 0.002 x 300 = 4.1 cores: the smallest number that keeps up is above that
    and one fewer does not keep up; three leave what they cannot do."""
    demand = small_demand()
    assert demand.mean_load == pytest.approx(4.1, rel=0.03)
    within = 1800.0
    least = smallest(demand, within)
    assert least.workers > 4 and least.keeps_up and least.p95 <= within
    assert not try_workers(demand, least.workers - 1, within).keeps_up
    behind = try_workers(demand, 3, within)
    assert behind.load > 1.0 and not behind.keeps_up
    missing = (demand.mean_load - 3) / np.mean(demand.service) * demand.duration
    assert behind.left == pytest.approx(missing, rel=0.1)


def test_kills_and_a_short_limit_take_more_workers():
    demand = small_demand()
    plain = smallest(demand, 1800.0).workers
    assert smallest(demand, 10.0).workers > plain
    assert smallest(demand, 1800.0, kill_rate=1 / 300.0).workers > plain


def test_costs_that_cannot_be_read_are_refused(tmp_path):
    """One line with file, field and remedy."""
    path = tmp_path / "costs.json"
    for text in (
        None,
        "{",
        "[]",
        '{"jobs": {"diagnose": [{"cpu_s": 1}]}}',
        json.dumps({"jobs": {"diagnose": [], "explain": [{"cpu_s": 1.0}]}}),
        json.dumps({"jobs": {"diagnose": [{"cpu_s": -1}], "explain": [{"cpu_s": 1.0}]}}),
    ):
        if text is not None:
            path.write_text(text)
        with pytest.raises(ValueError, match=r"costs\.json.*--measure$"):
            read_seconds(path)


def test_the_command_prints_what_keeps_up(tmp_path):
    """The last line names the number that the table has as its first without `falls behind`."""
    path = tmp_path / "costs.json"
    path.write_text(
        json.dumps({"jobs": {"diagnose": [{"cpu_s": 30}], "explain": [{"cpu_s": 100}]}})
    )
    options = ["--pumps", "300", "--days", "2", "--workers", "1", "9"]
    script = ROOT / "benchmarks" / "queue_of_pumps.py"
    command = [sys.executable, str(script), str(path), *options]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    rows = {int(line.split()[0]): line for line in told[2:-1]}
    least = int(told[-1].split()[0])
    assert set(rows) == {1, 9, least} and "falls behind" in rows[1]
    assert "falls behind" not in rows[least]
    refused = subprocess.run([*command, "--peak", "3"], capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and "--peak: 3.0 must be from 1 to 2" in refused.stderr


def test_the_cost_of_a_command_has_its_children(tmp_path):
    """Processor time of a child process counts, and a command that fails raises with its words."""
    child = "for _ in range(10**7): pass"
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    alone = run_command([sys.executable, "-c", "pass"])
    assert run_command([sys.executable, "-c", code])["cpu_s"] > 2 * alone["cpu_s"] > 0
    with pytest.raises(RuntimeError, match="ended with 3: what it said"):
        run_command([sys.executable, "-c", "print('what it said'); raise SystemExit(3)"])
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "file").write_bytes(b"four")
    assert size(tmp_path) == size(tmp_path / "folder" / "file") == 4
