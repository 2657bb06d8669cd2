"use strict";
/* charts - where the selected head was over time, and the truth (Chart.js). */
const Charts = (() => {
  const AXES = ["x", "y", "z"];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  let charts = [], frames = [], now = 0, pick = () => {};

  /* A line at the frame that is shown. */
  const marker = {
    id: "marker",
    afterDatasetsDraw(chart) {
      if (!frames[now] || frames[now].time_s === null) return;
      const x = chart.scales.x.getPixelForValue(frames[now].time_s), area = chart.chartArea, context = chart.ctx;
      context.save();
      context.strokeStyle = colour("bad");
      context.lineWidth = 2;
      context.beginPath();
      context.moveTo(x, area.top);
      context.lineTo(x, area.bottom);
      context.stroke();
      context.restore();
    },
  };

  /* Behind frames that are not right, as far as half of the way to those beside them. */
  const shade = {
    id: "shade",
    beforeDatasetsDraw(chart) {
      const timed = frames.filter((f) => f.time_s !== null), area = chart.chartArea, context = chart.ctx;
      const x = timed.map((f) => chart.scales.x.getPixelForValue(f.time_s));
      const half = x.length > 1 ? (x[x.length - 1] - x[0]) / (x.length - 1) / 2 : 4;
      context.save();
      context.fillStyle = colour("bad-ground");
      timed.forEach((f, i) => {
        if (Data.state(f) !== "wrong" && Data.state(f) !== "lost") return;
        const from = Math.max(i > 0 ? (x[i - 1] + x[i]) / 2 : x[i] - half, area.left);
        const to = Math.min(i + 1 < x.length ? (x[i] + x[i + 1]) / 2 : x[i] + half, area.right);
        context.fillRect(from, area.top, Math.max(to - from, 2), area.height);
      });
      context.restore();
    },
  };

  /* At least this much is shown of an axis, so that noise of a few mm does not look like a movement. */
  const SPAN_MM = 100;
  function span(axis) {
    const values = frames.flatMap((f) => [f.selected && f.selected.centre_mm, Data.truthMm(f)]).filter(Boolean).map((mm) => mm[axis]);
    if (values.length === 0) return {};
    const middle = (Math.min(...values) + Math.max(...values)) / 2;
    return { suggestedMin: middle - SPAN_MM / 2, suggestedMax: middle + SPAN_MM / 2 };
  }

  function datasets(axis) {
    const at = (frame, mm) => ({ x: frame.time_s, y: mm ? mm[axis] : null });
    const timed = frames.filter((f) => f.time_s !== null);
    const predicted = timed.map((f) => Boolean(f.selected && f.selected.predicted));
    const few = timed.length <= 150;
    return [
      { label: "found", data: timed.map((f) => at(f, f.selected && f.selected.centre_mm)), borderColor: colour("accent"),
        backgroundColor: timed.map((_, i) => predicted[i] ? colour("panel") : colour("accent")), borderWidth: 2,
        pointRadius: timed.map((_, i) => predicted[i] ? 4 : few ? 2 : 0), pointBorderColor: colour("accent"),
        pointBackgroundColor: timed.map((_, i) => predicted[i] ? colour("panel") : colour("accent")), pointBorderWidth: 1.5 },
      { label: "truth", data: timed.map((f) => at(f, Data.truthMm(f))), borderColor: colour("truth"),
        borderDash: [6, 4], borderWidth: 2, pointRadius: 0 },
      ...(Data.others.size === 0 ? [] : [{ label: "the other run", data: timed.map((f) => at(f, f.otherSelected && f.otherSelected.centre_mm)),
        borderColor: colour("other"), borderDash: [2, 3], borderWidth: 2, pointRadius: 0 }]),
    ];
  }

  function options(axis) {
    const scale = (text) => ({
      grid: { color: colour("line") }, ticks: { color: colour("quiet"), maxTicksLimit: 6 },
      title: { display: Boolean(text), text, color: colour("quiet") },
    });
    return {
      animation: false, responsive: true, maintainAspectRatio: false, normalized: true, spanGaps: false,
      interaction: { mode: "nearest", axis: "x", intersect: false },
      plugins: { legend: { display: false }, tooltip: { callbacks: {
        title: ([item]) => `${item.parsed.x.toFixed(2)} s`,
        label: (item) => `${item.dataset.label} ${item.parsed.y.toFixed(1)} mm` } } },
      scales: { x: { type: "linear", ...scale("s") }, y: { ...scale(""), ...span(axis) } },
      onClick(event, _items, chart) {
        const time = chart.scales.x.getValueForPixel(event.x);
        let best = 0;
        frames.forEach((f, i) => {
          if (f.time_s !== null && Math.abs(f.time_s - time) < Math.abs((frames[best].time_s ?? Infinity) - time)) best = i;
        });
        pick(frames[best].index);
      },
    };
  }

  /* The same in words. */
  function describe(axis) {
    const found = frames.filter((f) => f.selected).map((f) => f.selected.centre_mm[axis]);
    if (found.length === 0) return `${AXES[axis]} over time: no head was selected in any of ${frames.length} frames.`;
    const both = frames.filter((f) => f.selected && Data.truthMm(f));
    const off = both.map((f) => Math.abs(f.selected.centre_mm[axis] - Data.truthMm(f)[axis])).sort((a, b) => a - b);
    const truth = both.length ? ` Half of them lie within ${off[Math.floor((off.length - 1) / 2)].toFixed(1)} mm of the truth.` : "";
    return `${AXES[axis]} over time: a head in ${found.length} of ${frames.length} frames, from ` +
      `${Math.min(...found).toFixed(1)} to ${Math.max(...found).toFixed(1)} mm.${truth} The table below has all values.`;
  }

  function fillTable() {
    const box = document.querySelector("#path-values .scroll");
    const head = ["frame", "time s", "x mm", "y mm", "z mm", "true x", "true y", "true z", "error mm"];
    const cells = frames.map((f) => {
      const truth = Data.truthMm(f);
      return [f.record.file, f.time_s === null ? "" : f.time_s.toFixed(2),
        ...AXES.map((_, k) => f.selected ? f.selected.centre_mm[k].toFixed(1) : ""),
        ...AXES.map((_, k) => truth ? truth[k].toFixed(1) : ""),
        f.verdict && f.verdict.error_mm !== undefined ? `${f.verdict.error_mm}` : ""];
    });
    box.replaceChildren(Tables.table("Where the selected head was", head, cells));
  }

  const details = document.getElementById("path-values");
  details.addEventListener("toggle", () => { if (details.open) fillTable(); });

  /* All frames of a directory. */
  function show(all, onPick) {
    frames = all;
    pick = onPick;
    charts.forEach((chart) => chart.destroy());
    charts = AXES.map((_, axis) => {
      const canvas = document.getElementById(`chart-${axis}`);
      canvas.setAttribute("aria-label", describe(axis));
      return new Chart(canvas, { type: "line", data: { datasets: datasets(axis) }, options: options(axis), plugins: [shade, marker] });
    });
    if (details.open) fillTable();
  }
  function mark(index) {
    now = index;
    charts.forEach((chart) => chart.draw());
  }
  function theme() {
    charts.forEach((chart, axis) => {
      chart.data.datasets = datasets(axis);
      chart.options = options(axis);
      chart.update();
    });
  }
  return { show, mark, theme };
})();
