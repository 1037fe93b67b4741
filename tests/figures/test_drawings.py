"""Figures: words, scale, nothing cut off, a question asked, the place said or denied."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from made_results import AMPLITUDES, ORDERS, made_change, made_numbers
from rippletwin.diagnosis import diagnosed_numbers
from rippletwin.figures import attention, diagnosis, explained_numbers, ripple
from rippletwin.figures.explained_ripple import curve, plot_residuals, plot_ripple
from rippletwin.figures.explained_search import plot_evidence, plot_immittance
from rippletwin.figures.fault_posterior import plot_change, plot_severity
from rippletwin.figures.line_drawing import plot_place

NETWORKS, STATES = ["CNN1D (341@100)", "CNN2D (7×7@2)"], ["H", "S", "C1"]
DATASETS = (
    "CFD-P CFD-MOC-P CFD-MOC-P+ CFD-Q CFD-Q+ CFD-MOC-PR CFD-MOC-PRA CFD-QR experimental".split()
)
ACCURACIES = dict.fromkeys(DATASETS, np.array([[90.0, 3.0]] * 2))
RANKS = NETWORKS, [False, True], np.full((2, 2), 0.9), np.full((2, 2), 80.0)
ANGLES, HZ = np.arange(0, 360, 7.5), np.geomspace(30, 1500, 16)
RIPPLES = {"calibrated": 2e5 * np.sin(np.deg2rad([ANGLES] * 2))}
SHARES = [["", "24% of it on the orange 24%", "called C1: 100%"]] * 2
ALIKE = np.linspace(0.5, 1.5, 3 * 16 * 16).reshape(3, 16, 16)


def attended(region):
    """A figure of attention in images, with marks where the fault is or without."""
    marks = np.tile(HZ < 200, (3, 1)) if region else None
    heat = np.stack([ALIKE, ALIKE])
    return attention.plot_images(NETWORKS, STATES, ALIKE, heat, SHARES, HZ, 16.7, 9, marks)


DRAWN = {
    "calibration": lambda: ripple.plot_overlay(ANGLES, RIPPLES, ["p1", "p2"], "1000 r/min"),
    "states": lambda: ripple.plot_states(
        ANGLES, dict(zip(STATES, ALIKE[:, 0].repeat(3, 1))), "bar"
    ),
    "confusion": lambda: diagnosis.plot_confusion(
        dict.fromkeys(NETWORKS, np.eye(3)), STATES, STATES
    ),
    "accuracy": lambda: diagnosis.plot_accuracy(
        NETWORKS, {"CFD-P": np.array([[90.0, 3.0]] * 2)}, {"CFD-P": np.array([[80.0, 2.0]] * 2)}
    ),
    "accuracy, all datasets": lambda: diagnosis.plot_accuracy(NETWORKS, ACCURACIES, ACCURACIES),
    "images": lambda: diagnosis.plot_sst(dict(zip(STATES, ALIKE)), HZ, 16.7, 9),
    "attention": lambda: attention.plot_windows(
        NETWORKS, STATES, ALIKE[:, 0], np.stack([ALIKE[:, 0]] * 2), SHARES, "ripple / bar"
    ),
    "attention in images": lambda: attended(region=False),
    "attention in images, marked": lambda: attended(region=True),
    "ranks": lambda: attention.plot_ranks({"CFD-P": RANKS}),
    "ranks, all datasets": lambda: attention.plot_ranks(dict.fromkeys(DATASETS[:-1], RANKS)),
    "claims": lambda: attention.plot_claims(
        {
            "Images are better": (
                ["a network", "CFD-MOC-P+: " + " − ".join(NETWORKS)],
                np.array([[5.0, 2, 8], [-3, -9, 1]]),
            )
        }
    ),
    "ripple": lambda: plot_ripple(made_numbers()),
    "ripple, mixed kinds": lambda: plot_ripple(mixed_numbers()),
    "ripple, nothing found": lambda: plot_ripple(made_numbers(found=False)),
    "residuals": lambda: plot_residuals(made_numbers()),
    "evidence": lambda: plot_evidence(made_numbers()),
    "immittance": lambda: plot_immittance(made_numbers()),
    "place": lambda: plot_place(made_numbers()),
    "place, nothing found": lambda: plot_place(made_numbers(found=False)),
    "change": lambda: plot_change(made_change()),
    "severity": lambda: plot_severity(made_change()),
}


def texts(figure):
    """Every text of a figure that is drawn, as matplotlib artists."""
    figure.draw_without_rendering()
    beyond = set()  # labels of ticks outside the limits of an axis exist, and are not drawn
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        low, high = sorted(axis.get_view_interval())
        for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
            if not low <= tick.get_loc() <= high:
                beyond |= {tick.label1, tick.label2}
    for ax in figure.axes:
        if not ax.get_visible():
            beyond |= set(ax.findobj(Text))
    drawn = [t for t in figure.findobj(Text) if t.get_visible() and t not in beyond]
    return [t for t in drawn if t.get_text().strip()]


def test_more_networks_than_colours_differ_in_their_markers():
    """Nine networks of either kind, which somebody has added: no two of them look alike."""
    names = [f"network {k}" for k in range(18)]
    images = [k % 2 == 0 for k in range(18)]
    points = np.full((18, 2), 0.9), np.full((18, 2), 80.0)
    figure = attention.plot_ranks({"CFD-P": (names, images, *points)})
    lines = [drawn.lines[0] for drawn in figure.axes[0].containers]
    assert len({(line.get_marker(), line.get_color()) for line in lines}) == 18


@pytest.mark.parametrize("name", DRAWN)
def test_no_text_is_cut_off(name):
    """Every text that is drawn lies within the picture."""
    figure = DRAWN[name]()
    width, height = figure.canvas.get_width_height()
    for text in texts(figure):
        box = text.get_window_extent()
        inside = box.x0 > -1 and box.y0 > -1 and box.x1 < width + 1 and box.y1 < height + 1
        assert inside, (text.get_text(), box)


@pytest.mark.parametrize("name", DRAWN)
def test_no_text_lies_on_another(name):
    """Titles, legends, labels and ticks keep apart."""
    boxes = [(t.get_text(), t.get_window_extent().shrunk(0.98, 0.9)) for t in texts(DRAWN[name]())]
    for k, (one, box) in enumerate(boxes):
        assert not [(one, other) for other, b in boxes[k + 1 :] if box.overlaps(b)]


@pytest.mark.parametrize("name", DRAWN)
def test_a_figure_asks_a_question_and_names_no_identifier(name):
    """Its title asks what it answers, and labels are words; labels of recordings are the user's."""
    figure = DRAWN[name]()
    words = " ".join(t.get_text() for t in texts(figure))
    for label in ("healthy_0", "unknown_0"):
        words = words.replace(label, "")
    assert "?" in words and "_" not in words


@pytest.mark.parametrize("name", DRAWN)
def test_a_logarithmic_axis_says_so(name):
    """Whoever reads a bar's length must know the scale."""
    figure = DRAWN[name]()
    words = " ".join(t.get_text() for t in texts(figure))
    scales = {axis.get_scale() for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)}
    assert ("logarithmic" in words) is bool(scales & {"log", "symlog"})


def named(numbers, name):
    """The numbers behind explain's figures, each sensor, recording and effect called `name`."""
    points = [replace(p, sensors=(name,) * 2, label=name, speed_rpm=None) for p in numbers.points]
    places = numbers.places
    sensors = tuple((name, x) for _, x in places.sensors)
    found = tuple(replace(place, words=name) for place in places.found)
    return replace(
        numbers,
        points=tuple(points),
        places=replace(places, sensors=sensors, found=found),
        candidates=tuple(replace(c, effects=(name,)) for c in numbers.candidates),
        missing=tuple(replace(m, effect=name) for m in numbers.missing),
    )


OF_NAMES = {
    "ripple": lambda name: plot_ripple(named(made_numbers(), name)),
    "residuals": lambda name: plot_residuals(named(made_numbers(), name)),
    "evidence": lambda name: plot_evidence(named(made_numbers(), name)),
    "immittance": lambda name: plot_immittance(named(made_numbers(), name)),
    "place": lambda name: plot_place(named(made_numbers(), name)),
    "change": lambda name: plot_change(replace(made_change(name), sensors=[name, name])),
    "severity": lambda name: plot_severity(made_change(name)),
    "calibration": lambda name: ripple.plot_overlay(ANGLES, RIPPLES, [name, name], name),
}


@pytest.mark.parametrize("figure", OF_NAMES)
def test_a_dollar_in_a_name_is_a_dollar(figure):
    """Between two of them matplotlib reads mathematics, and fails where it is none."""
    drawn = texts(OF_NAMES[figure]("a$^$b"))
    assert any("a\\$^\\$b" in text.get_text() for text in drawn)


def test_the_residual_of_one_frequency_is_drawn():
    """A band may leave one frequency: its cell has edges of its own."""
    numbers = made_numbers()
    first = numbers.points[0]
    one = {
        name: getattr(first, name)[..., :1]
        for name in ("frequency_hz", "orders", "measured", "calibrated", "corrected")
        + ("residual_calibrated", "residual_corrected")
    }
    figure = plot_residuals(replace(numbers, points=(replace(first, **one),)))
    assert "which frequencies" in " ".join(t.get_text() for t in texts(figure))


def test_a_ripple_panel_says_speed_pressure_and_error():
    """Error by hand: half of the ripple, at right angles, is 50 %; 2 % too large is 2 %."""
    words = " ".join(t.get_text() for t in texts(plot_ripple(made_numbers())))
    assert "1000 r/min, 95 bar" in words and "error 50 % → 2.0 %" in words


def test_two_sensors_that_tell_no_place_say_so():
    """In place of a flat line: a sentence. A short interval is drawn, and given in metres."""
    far = " ".join(t.get_text() for t in texts(plot_place(made_numbers(free=(0.0, 8.9)))))
    near = " ".join(t.get_text() for t in texts(plot_place(made_numbers(free=(2.0, 2.4)))))
    assert "two sensors cannot tell the place" in far and "best single place" not in far
    assert "fits best from 2.00 to 2.40 m" in near and "best single place" in near


def test_the_ripple_in_bar_is_that_of_its_amplitudes():
    """Against the sum of cosines, written out."""
    angle, pressure = curve(made_numbers().points[0], AMPLITUDES[0])
    by_hand = sum(
        3e5 / 1e5 * w * np.cos(np.deg2rad(angle) * k)
        for k, w in zip(ORDERS, AMPLITUDES[0].real / 3e5)
    )
    assert angle[-1] == pytest.approx(40.0)
    np.testing.assert_allclose(pressure, by_hand, atol=1e-12)


def test_numbers_behind_figures_come_back_from_their_files(tmp_path):
    """What reports read is what figures showed."""
    (tmp_path / "figures").mkdir()
    explained, changed = made_numbers(), made_change()
    explained_numbers.save(explained, tmp_path)
    diagnosed_numbers.save([changed], tmp_path)
    back = explained_numbers.load(tmp_path)
    np.testing.assert_allclose(back.points[0].calibrated, explained.points[0].calibrated)
    np.testing.assert_allclose(back.missing[0].law, explained.missing[0].law)
    assert back.candidates == explained.candidates and back.places == explained.places
    assert diagnosed_numbers.load(tmp_path) == {"unknown_0": changed}


def test_a_reading_error_of_rounding_is_not_drawn(monkeypatch):
    """A law of 1e-16 of the reading is rounding noise: it has no panel."""
    from types import SimpleNamespace

    frequency = np.array([100.0, 200.0])
    noise = SimpleNamespace(
        quantity="relative error of the reading", unit="1", frequency_hz=frequency,
        law=np.full(2, 1e-16 + 0j), points=np.full(2, 1e-16 + 0j), sd=np.full(2, 1e-17),
    )  # fmt: skip
    real = SimpleNamespace(**vars(noise) | {"law": np.full(2, 0.1 + 0j)})
    effects = [(SimpleNamespace(name="sensor_gain"), "sensor p1")] * 2
    accepted = SimpleNamespace(hypothesis=effects)
    found = iter([noise, real])
    monkeypatch.setattr(explained_numbers, "find_missing_immittance", lambda *_: next(found))
    decision = SimpleNamespace(accepted=accepted)
    (shown,) = explained_numbers._missing(SimpleNamespace(decision=decision, observations=()))
    assert shown.law[0] == 0.1


def test_figures_without_a_search_or_sensors_are_left_out():
    """Contradicting data are not searched; an impedance has no sensor along the line."""
    numbers = made_numbers()
    assert plot_evidence(replace(numbers, candidates=())) is None
    assert plot_place(replace(numbers, places=replace(numbers.places, sensors=()))) is None
    assert plot_immittance(replace(numbers, missing=())) is None


def mixed_numbers():
    """Two operating points with the spectra of a broadband source between and after them."""
    numbers = made_numbers()
    (periodic,) = numbers.points
    spectrum = replace(
        periodic,
        label="shaker",
        kind="random",
        orders=None,
        speed_rpm=None,
        load_pressure=None,
        measured=1e-3 * periodic.measured,
        calibrated=1e-3 * periodic.calibrated,
        corrected=1e-3 * periodic.corrected,
    )
    return replace(numbers, points=(periodic, spectrum, periodic, spectrum))


def test_ripples_of_a_mixed_case_keep_a_scale_and_a_unit_of_their_own():
    """Ripples in bar pass zero and are drawn on a linear axis beside spectra on a logarithmic one;
    panels of one kind share their axis, and the first of each kind names its unit."""
    figure = plot_ripple(mixed_numbers())
    figure.draw_without_rendering()
    rows = np.reshape(figure.axes, (2, 4))
    for row in rows:
        assert [ax.get_yscale() for ax in row] == ["linear", "log", "linear", "log"]
        assert row[0].get_ylim() == row[2].get_ylim() != row[1].get_ylim() == row[3].get_ylim()
        units = [ax.get_ylabel() for ax in row]
        assert "ripple / bar" in units[0] and "amplitude / Pa" in units[1] and not any(units[2:])
        assert row[0].get_ylim()[0] < 0.0 < row[1].get_ylim()[0]
