"""The page in a real browser: no complaint, readable at any width, accessible, and it works.

Needs Debian's `chromium` and the packages playwright and axe-playwright-python; skipped without.
"""

from __future__ import annotations

import os
import shutil

import pytest

from diagnosed_rigs import made_rows
from diagnosis_trial.population_charts import chart_population
from made_results import HOSTILE, write_results
from rippletwin.report.content import WorkflowPart
from rippletwin.report.page import write_report
from rippletwin.report.results import read_results

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
WIDTHS = {"phone": 390, "desk": 1280}

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium to look with")


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = write_results(tmp_path_factory.mktemp("case"))
    workflow = WorkflowPart(population=chart_population(made_rows()))
    return write_report(read_results(folder), folder / "report.html", workflow)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """A function that opens the report: width, colour scheme -> (page, what was complained of and
    requested)."""
    with playwright.sync_playwright() as run:
        contexts = []

        def show(report, width=1280, scheme="light"):
            context = run.chromium.launch_persistent_context(
                tmp_path_factory.mktemp("profile"), executable_path=CHROMIUM, args=list(FLAGS),
                viewport={"width": width, "height": 900}, color_scheme=scheme,
            )  # fmt: skip
            contexts.append(context)
            page, heard = context.new_page(), []
            page.on("console", lambda message: heard.append(message.text))
            page.on("pageerror", lambda error: heard.append(str(error)))
            page.on("dialog", lambda dialog: (heard.append(dialog.message), dialog.dismiss()))
            page.on("request", lambda request: heard.append(request.url))
            page.goto(report.as_uri())
            assert heard.pop(0) == report.as_uri()
            return page, heard

        yield show
        for context in contexts:
            context.close()


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_every_figure_is_visible_and_nothing_is_complained_of(browser, report, width):
    """At the width of a phone and of a desk: no console message, no request, no sideways scrolling
    of the page, and every chart as large as a reader needs."""
    page, heard = browser(report, width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    boxes = [chart.bounding_box() for chart in page.query_selector_all("svg.chart, svg.matrix")]
    assert len(boxes) >= 11
    assert all(b["width"] >= 250 and b["height"] >= 140 for b in boxes), boxes
    assert all(b["x"] >= 0 and b["x"] + b["width"] <= width for b in boxes)
    lines = [line for line in page.query_selector_all("svg.line-picture") if line.is_visible()]
    assert len(lines) == 1 and lines[0].bounding_box()["width"] > 0.8 * min(width, 1000)
    assert not heard


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_texts_of_the_line_and_of_charts_are_not_cut_off(browser, report, width):
    """Every text of a drawing lies within the drawing."""
    page, _ = browser(report, width)
    cut_off = page.evaluate(
        """() => Array.from(document.querySelectorAll("svg.chart, svg.matrix, svg.line-picture"))
        .filter((svg) => svg.getBoundingClientRect().width > 0)
        .flatMap((svg) => {
          const box = svg.getBoundingClientRect();
          return Array.from(svg.querySelectorAll("text"))
            .filter((text) => {
              const b = text.getBoundingClientRect();
              return b.left < box.left - 1.5 || b.right > box.right + 1.5 ||
                     b.top < box.top - 1.5 || b.bottom > box.bottom + 1.5;
            })
            .map((text) => text.textContent);
        })"""
    )
    assert not cut_off


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_texts_of_a_chart_do_not_lie_on_each_other(browser, report, width):
    """No two texts of one chart share a place: a tick's number and an axis' words stay apart."""
    page, _ = browser(report, width)
    covered = page.evaluate(
        """() => Array.from(document.querySelectorAll("svg.chart")).flatMap((svg) => {
          const texts = Array.from(svg.querySelectorAll("text"));
          const boxes = texts.map((text) => text.getBoundingClientRect());
          return texts.flatMap((text, i) => texts.slice(i + 1).filter((_, k) => {
            const a = boxes[i], b = boxes[i + 1 + k];
            return Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
                   Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
          }).map((other) => [text.textContent, other.textContent]));
        })"""
    )
    assert not covered


def test_a_row_keeps_its_name_on_a_phone(browser, report):
    """A table wider than the phone scrolls under its first column; its caption is read whole."""
    page, _ = browser(report, WIDTHS["phone"])
    box = page.locator("#parameters .table-box")
    caption = box.locator("caption span").bounding_box()
    assert caption["x"] + caption["width"] <= WIDTHS["phone"]
    scrolled = box.evaluate("box => { box.scrollLeft = 1e4; return box.scrollLeft; }")
    name = box.locator("tbody td").first.bounding_box()
    assert scrolled > 50 and name["x"] >= 0 and name["width"] < WIDTHS["phone"] / 2


def test_a_hostile_label_runs_nothing(browser, report):
    """The label is on the page as text; its handler has not run."""
    page, heard = browser(report)
    assert HOSTILE in page.inner_text("#diagnosis") and not heard


def test_the_pointer_shows_values(browser, report):
    """Over a chart its values are written below it, and gone when the pointer leaves."""
    page, _ = browser(report)
    page.hover("#ripples svg.chart >> nth=0")
    said = page.inner_text("#ripples .readout >> nth=0")
    assert "shaft angle" in said and "measured" in said and "bar" in said
    page.hover("h1")
    assert page.inner_text("#ripples .readout >> nth=0") == ""


def test_the_pointer_finds_its_place_on_a_logarithmic_axis(browser, report):
    """Where 0.420 of the axis of changes from 0.316 to 56.2 % are passed, in the middle of the
    picture, the change is 0.316 (56.2 / 0.316)^0.420 = 2.8 %."""
    page, _ = browser(report)
    page.locator("#population svg.chart").first.hover()
    said = page.inner_text("#population .readout >> nth=0")
    number = float(said.split("% ")[1].split(":")[0])
    assert said.startswith("change of the ripple %") and 2.6 < number < 3.0


def test_the_keyboard_shows_values(browser, report):
    """The arrow keys step through a chart's points, whose first is at no angle."""
    page, _ = browser(report)
    chart = page.locator("#ripples svg.chart").first
    chart.focus()
    first = page.inner_text("#ripples .readout >> nth=0")
    chart.press("ArrowRight")
    second = page.inner_text("#ripples .readout >> nth=0")
    assert first.startswith("shaft angle degrees 0:") and first != second


def test_tables_sort_by_number_and_back(browser, report):
    """A click sorts by the numbers behind the text, a second one the other way."""
    page, _ = browser(report)
    header = page.locator("#parameters th", has_text="Data sheet")

    def values():
        cells = page.query_selector_all("#parameters tbody tr td:nth-child(2)")
        return [float(cell.get_attribute("data-value")) for cell in cells]

    header.locator("button").click()
    assert values() == sorted(values()) and header.get_attribute("aria-sort") == "ascending"
    header.locator("button").press("Enter")
    assert values() == sorted(values(), reverse=True)


def test_dark_is_dark_and_print_is_light(browser, report):
    """The scheme follows the reader's; paper is white, and has no navigation."""
    page, _ = browser(report, scheme="dark")
    colour = "getComputedStyle(document.body).backgroundColor"
    assert page.evaluate(colour) == "rgb(18, 24, 31)"
    page.emulate_media(media="print", color_scheme="light")
    assert page.evaluate(colour) == "rgb(255, 255, 255)"
    assert not page.is_visible("nav")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_there_is_no_serious_fault_of_accessibility(browser, report, width, scheme):
    """axe-core, all of its rules: contrast, names of drawings, order of headings, tables."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page, _ = browser(report, width, scheme)
    faults = axe.run(page).response["violations"]
    serious = [
        (fault["id"], [node["html"][:120] for node in fault["nodes"]])
        for fault in faults
        if fault["impact"] in ("serious", "critical")
    ]
    assert not serious
