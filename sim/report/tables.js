"use strict";
/* tables - values beside the limits that they were compared with. Text only ever enters as text. */
const Tables = (() => {
  function element(name, attributes = {}, ...children) {
    const e = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (value !== undefined && value !== false) e.setAttribute(key, value === true ? "" : value);
    }
    e.append(...children.filter((c) => c !== null && c !== undefined));
    return e;
  }

  function table(caption, head, rows) {
    return element("table", {},
      element("caption", { class: "hidden" }, caption),
      element("thead", {}, element("tr", {}, ...head.map((h) => element("th", { scope: "col" }, h)))),
      element("tbody", {}, ...rows.map((row) => element("tr", {}, ...row.map((cell) => element("td", {}, cell))))));
  }

  /* A table whose rows are cards on a narrow screen; roles, as a browser forgets them with the layout. */
  function fillCards(into, caption, head, rows) {
    into.replaceChildren(element("caption", { class: "hidden" }, caption),
      element("thead", { role: "rowgroup" }, element("tr", { role: "row" }, ...head.map((h, i) =>
        element("th", { scope: "col", role: "columnheader", class: i === 1 ? "text" : undefined }, h)))),
      element("tbody", { role: "rowgroup" }, ...rows));
    for (const row of rows) {
      row.setAttribute("role", "row");
      const cells = [...row.children];
      cells.forEach((cell) => cell.setAttribute("role", cell.tagName === "TH" ? "rowheader" : "cell"));
      cells.slice(1).forEach((cell, i) => { cell.dataset.head = head[i + 1]; });
    }
  }

  const whole = (value) => Math.round(value).toString().replace(/\B(?=(\d{3})+$)/g, "\u202f"); /* a thin space */

  /* Table 1 */
  const NOBODY = "without a head";
  function fillTable1() {
    const body = document.querySelector("#table1 tbody");
    const row = (label, t, error, isEmpty) => element("tr", { class: isEmpty && label === NOBODY ? "empty" : label === "all" ? "sum" : undefined },
      element("th", { scope: "row" }, label), ...[t.frames, isEmpty ? "–" : t.detected, isEmpty ? "–" : t.frames - t.detected,
        isEmpty ? "–" : t.correct, isEmpty ? "–" : t.ambiguous, t.wrong, t["not done"], t.right, error[0] ?? "–", error[1] ?? "–"]
        .map((value) => element("td", {}, `${value}`)));
    for (const r of Data.rows) {
      if (r.with_head.frames > 0) body.append(row(r.label, r.with_head, r.error_mm, false));
      if (r.empty.frames > 0) body.append(row(r.with_head.frames > 0 ? NOBODY : r.label, r.empty, [], true));
    }
    const none = body.childElementCount === 0;
    document.getElementById("table1").parentElement.hidden = none;
    document.getElementById("no-truth").hidden = !none;
  }

  /* A value beside its limit; what fails says so in words too. */
  function held(value, limit, passes) {
    return element("td", passes ? {} : { class: "fails" }, `${value}${passes ? "" : " ✗"}`, element("small", {}, limit),
      passes ? null : element("span", { class: "hidden" }, " fails"));
  }

  const probability = (logit) => 1 / (1 + Math.exp(-logit));

  function decision(record, index) {
    const h = record.hypotheses[index];
    const text = h.rejected !== null ? `rejected: ${h.rejected}` : index === record.head ? "the head" : "accepted";
    const tag = element("span", { class: `tag ${h.rejected === null ? "good" : "bad"}` }, text);
    return element("td", { class: "text" }, tag, h.predicted ? element("small", {}, "predicted: not seen here") : null);
  }

  function hypothesisRow(frame, index, chosen, choose) {
    const record = frame.record, h = record.hypotheses[index], limits = Data.dirs[frame.dir].limits;
    const button = element("button", { type: "button", "aria-pressed": `${index === chosen}`,
      "aria-label": `Hypothesis ${index}` }, `${index}`);
    button.addEventListener("click", () => choose(index));
    const once = probability(limits.start_head_logit_q10 / 1024).toFixed(3);
    const later = probability(limits.accept_logit_q10 / 1024).toFixed(3);
    return element("tr", index === chosen ? { class: "chosen" } : {}, element("th", { scope: "row" }, button),
      decision(record, index),
      h.score === undefined ? null
        : held(h.score.toFixed(3), `over ${once} at once, ${later} from frame ${limits.mature_findings} on`, h.rejected === null),
      element("td", {}, h.centre_mm.map((v) => v.toFixed(1)).join(", "),
        h.sigma_mm === undefined ? null : element("small", {}, `± ${h.sigma_mm.toFixed(1)}, track ${h.track}`),
        !h.pose_deg ? null : element("small", {}, `looks ${h.pose_deg.map((v) => v.toFixed(1)).join("°, ")}°`)),
      element("td", {}, h.distance_mm.toFixed(1)),
      element("td", {}, h.pixel.map((v) => v.toFixed(2)).join(", "),
        element("small", {}, `${h.axes_px.map((v) => v.toFixed(2)).join(" × ")}, ${h.angle_deg.toFixed(1)}°`)));
  }

  function fillHypotheses(frame, chosen, choose) {
    const into = document.getElementById("hypotheses"), text = document.getElementById("hypotheses-text");
    const record = frame.record, dir = Data.dirs[frame.dir], l = dir.limits;
    const hypotheses = record.hypotheses || [];
    into.parentElement.hidden = hypotheses.length === 0;
    if (hypotheses.length === 0) {
      text.textContent = record.error !== undefined ? `The frame could not be processed: ${record.error}` : "There are none in this frame.";
      into.replaceChildren();
      return;
    }
    const odds = (q10) => (q10 / 1024).toFixed(1);
    text.textContent = dir.paper ? "The paper’s method alone: the tests are in the table of nests below."
      : `The score is the probability of a head by all evidence together, of a track its mean over frames. A head starts ` +
        `above log-odds of ${odds(l.start_head_logit_q10)}, or ${odds(l.accept_logit_q10)} once it was found in ${l.mature_findings} frames, ` +
        `and stays one until they fall below ${odds(l.drop_logit_q10)} (a score of ${probability(l.drop_logit_q10 / 1024).toFixed(3)}). ` +
        `What has moved by ${l.moved_mm} mm since it was first found needs ${odds(l.moved_logit_q10)} less.`;
    const head = ["No.", "Decision", ...(dir.paper ? [] : ["Score"]), "Centre x, y, z in mm", "Distance in mm", "Ellipse in pixels"];
    fillCards(into, "Hypotheses of this frame", head, hypotheses.map((_, i) => hypothesisRow(frame, i, chosen, choose)));
  }

  /* Kinds of evidence (firmware/core/detect/ih_evidence.h): what they are, unit, decimals. */
  const KINDS = {
    on: ["points on the ellipsoid", "", 0], rough: ["their distance from it", "mm", 1], bulge: ["rounder than a plane by", "mm", 1],
    tall: ["taller than the mean head by", "%", 0], moved: ["moved by the fit", "mm", 0],
    bend_down: ["how uneven from dot to dot, downwards", "mm", 1], bend_across: ["how uneven from dot to dot, across", "mm", 1],
    distance: ["how far away it is", "mm", 0],
  };

  /* The log-odds before any evidence, the same for all of a frame: read from one without a track, whose
   * log-odds are no mean over frames. null where there is none. */
  function baseOf(trace) {
    const free = trace.findings.find((f) => f.track === 0 && f.part_q10);
    return free ? (free.logit_q10 - free.part_q10.reduce((sum, p) => sum + p, 0)) / 1024 : null;
  }

  /* What was there before has no bar: it is larger than all others, which would be too short to be distinguished. */
  function evidenceRow(name, value, part, largest) {
    const [text, unit, decimals] = KINDS[name] || [name, "", 2];
    const bar = largest === null ? null : element("i", { class: part >= 0 ? "for" : "against", style: `width:${(Math.abs(part) / largest * 48).toFixed(1)}%` });
    return element("tr", {}, element("th", { scope: "row" }, text),
      element("td", {}, value === null ? "" : `${value.toFixed(decimals)}${unit ? `\u202f${unit}` : ""}`),
      element("td", {}, `${part >= 0 ? "+" : ""}${part.toFixed(2)}`),
      element("td", { "aria-hidden": "true" }, bar && element("div", { class: "bar" }, bar)));
  }

  /* Parts of the log-odds: of each measure, and of the learnt maps those that say most; what the others say is one row. */
  const MAPS_SHOWN = 6;

  function partsOf(trace, detection) {
    if (!detection.part_q10) return [];
    const measures = trace.evidence.length;
    const all = detection.part_q10.map((p, i) => i < measures ? { name: trace.evidence[i], value: detection.evidence_q8[i] / 256, part: p / 1024 }
      : { name: `what all dots there say by learnt map ${i - measures}`, value: detection.answer_q8[i - measures] / 256, part: p / 1024 });
    const bySize = (parts) => parts.sort((a, b) => Math.abs(b.part) - Math.abs(a.part));
    const maps = bySize(all.slice(measures));
    const others = maps.splice(MAPS_SHOWN).reduce((sum, p) => sum + p.part, 0);
    return bySize([...all.slice(0, measures), ...maps, { name: "by the other maps", value: null, part: others }]);
  }

  /* Why a hypothesis has its score: each part of the log-odds, the largest first. */
  function fillEvidence(frame, trace, chosen) {
    const into = document.getElementById("evidence");
    const detection = trace && !Data.dirs[frame.dir].paper ? trace.findings[chosen] : null;
    if (!detection) {
      into.replaceChildren();
      return;
    }
    const parts = partsOf(trace, detection);
    const base = baseOf(trace);
    const largest = Math.max(...parts.map((p) => Math.abs(p.part)), 0.01);
    const h = frame.record.hypotheses[chosen];
    const title = h.predicted ? `Hypothesis ${chosen} is predicted by its track: it was not seen, so there is no evidence of this frame`
      : parts.length === 0 ? `Hypothesis ${chosen}: what it was measured by is not known any more`
      : `Evidence for (right, green) and against (left) hypothesis ${chosen}: log-odds ${(detection.logit_q10 / 1024).toFixed(2)}` +
        `${detection.track === 0 ? "" : ", a mean over the frames of its track"}`;
    const rows = parts.map((p) => evidenceRow(p.name, p.value, p.part, largest));
    if (base !== null && rows.length > 0) rows.unshift(evidenceRow("before any evidence", null, base, null));
    const head = ["Evidence", "Value", "Log-odds", ""];
    const open = into.querySelector("details") ? into.querySelector("details").open : true;
    into.replaceChildren(element("details", { open }, element("summary", {}, title),
      rows.length === 0 ? null : element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": title },
        element("table", { class: "bars" }, element("caption", { class: "hidden" }, title),
          element("thead", {}, element("tr", {}, ...head.map((t) => element("th", { scope: "col" }, t)))),
          element("tbody", {}, ...rows)))));
  }

  /* The paper's tests of a nest, in their order (firmware/core/nests/ih_hypotheses.h). */
  function tests(h, l) {
    const fraction = (part, all, min) => [all === 0 ? "nothing there" : `${part} of ${all}`, `at least ${min} %`, part * 100 >= all * min];
    const o = h.outline;
    return [
      [whole(h.area_mm2), `${whole(l.area_min_mm2)} to ${whole(l.area_max_mm2)}`, h.area_mm2 >= l.area_min_mm2 && h.area_mm2 <= l.area_max_mm2],
      [(h.curvature_mm_q8 / 256).toFixed(0), `${l.curvature_min_mm} to ${l.curvature_max_mm}`,
        h.curvature_mm_q8 >= l.curvature_min_mm * 256 && h.curvature_mm_q8 <= l.curvature_max_mm * 256],
      [(h.extent_mm_q8 / 256).toFixed(1), `at least ${l.extent_min_mm}`, h.extent_mm_q8 >= l.extent_min_mm * 256],
      [(h.upright_q16 / 65536).toFixed(2), `at least ${(l.upright_min_q16 / 65536).toFixed(2)}`, h.upright_q16 >= l.upright_min_q16],
      [`${o.inside}`, `at least ${l.points_min}`, o.inside >= l.points_min],
      fraction(o.above_behind, o.above, l.above_min_percent),
      fraction(o.beside_behind, o.beside, l.beside_min_percent),
      fraction(o.below_near, o.below, l.below_min_percent),
    ];
  }

  function fillNests(frame, trace) {
    const into = document.getElementById("nests"), text = document.getElementById("nests-text");
    const nests = trace ? trace.heads.hypothesis : [], dir = Data.dirs[frame.dir];
    into.parentElement.hidden = nests.length === 0;
    text.textContent = nests.length === 0 ? "There are none in this frame."
      : "Below each value is its limit. The first test that fails, in this order, is the reason; later ones are shown too." +
        (dir.paper ? "" : " With the whole method a nest is only a candidate: the scores above decide.");
    const head = ["Nest", "By the paper", "Area mm²", "Curvature mm", "Extent mm", "Height²/width²", "Points on it", "Behind, above", "Behind, beside", "Near, below"];
    fillCards(into, "Nests and the tests of the paper", head, nests.map((h, i) => element("tr", {},
      element("th", { scope: "row" }, `${i}`),
      element("td", { class: "text" }, element("span", { class: `tag ${h.rejected === null ? "good" : "bad"}` },
        h.rejected === null ? "accepted" : `rejected: ${h.rejected}`)),
      ...tests(h, trace.heads.limits).map((t) => held(...t)))));
  }

  return { element, table, fillTable1, fillHypotheses, fillEvidence, fillNests };
})();
