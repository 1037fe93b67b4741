"use strict";
// Values under the pointer, and tables that sort. Nothing is requested from anywhere.
(function () {
  function format(value) {
    if (value === null) return null;
    return String(Number(value.toPrecision(3))).replace("-", "\u2212");
  }

  function follow(svg) {
    const chart = JSON.parse(svg.dataset.chart);
    const readout = svg.parentElement.querySelector(".readout");
    const cursor = svg.querySelector(".cursor");
    const [left, width] = chart.plot;
    const [low, high] = chart.range;  // exponents of ten where x is logarithmic
    const places = chart.x.map(function (x) { return chart.xLogarithmic ? Math.log10(x) : x; });

    let nearest = 0;

    function point(event) {
      const box = svg.getBoundingClientRect();
      const place = ((event.clientX - box.left) / box.width) * svg.viewBox.baseVal.width;
      const wanted = low + ((place - left) / width) * (high - low);
      places.forEach(function (x, k) {
        if (Math.abs(x - wanted) < Math.abs(places[nearest] - wanted)) nearest = k;
      });
      show();
    }

    function step(event) {
      const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!by) return;
      event.preventDefault();
      nearest = Math.min(Math.max(nearest + by, 0), chart.x.length - 1);
      show();
    }

    function hide() {
      cursor.style.visibility = "hidden";
      readout.textContent = "";
    }

    function show() {
      const at = left + ((places[nearest] - low) / (high - low)) * width;
      cursor.setAttribute("x1", at);
      cursor.setAttribute("x2", at);
      cursor.style.visibility = "visible";
      const said = chart.series
        .map(function (s) { return [s.name, format(s.y[nearest])]; })
        .filter(function (pair) { return pair[1] !== null; })
        .map(function (pair) { return pair.join(" "); });
      readout.textContent =
        chart.xLabel.replace(" /", "") + " " + format(chart.x[nearest]) + ": " + said.join(", ") +
        " (" + chart.yLabel + ")";
    }

    svg.addEventListener("pointermove", point);
    svg.addEventListener("pointerdown", point);
    svg.addEventListener("pointerleave", hide);
    svg.addEventListener("keydown", step);
    svg.addEventListener("focus", show);
    svg.addEventListener("blur", hide);
  }

  function sortBy(header, column) {
    const table = header.closest("table");
    const rising = header.getAttribute("aria-sort") !== "ascending";
    table.querySelectorAll("th").forEach(function (th) { th.removeAttribute("aria-sort"); });
    header.setAttribute("aria-sort", rising ? "ascending" : "descending");
    const body = table.tBodies[0];
    const numeric = header.classList.contains("number");
    const rows = Array.from(body.rows).sort(function (a, b) {
      const x = a.cells[column].dataset.value;
      const y = b.cells[column].dataset.value;
      const order = numeric ? Number(x) - Number(y) : x.localeCompare(y, "en", { numeric: true });
      return rising ? order : -order;
    });
    rows.forEach(function (row) { body.appendChild(row); });
  }

  document.querySelectorAll("svg.chart").forEach(follow);
  document.querySelectorAll("table").forEach(function (table) {
    Array.from(table.tHead.rows[0].cells).forEach(function (header, column) {
      header.querySelector("button").addEventListener("click", function () {
        sortBy(header, column);
      });
    });
  });
})();
