"use strict";
/* picture - the frame with what was found in it, drawn in the frame's own pixels. */
const Picture = (() => {
  const canvas = document.getElementById("picture");
  const HEAD_DEPTH_MM = 200;
  const layers = {};
  let shown = null, chosen = 0;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  /* What brings the brightest hundredth of an image near to white: dots are dim, rooms dark. */
  const factors = new WeakMap();
  function brightness(image) {
    if (!factors.has(image)) {
      const small = document.createElement("canvas");
      small.width = 160;
      small.height = 120;
      const context = small.getContext("2d", { willReadFrequently: true });
      context.drawImage(image, 0, 0, small.width, small.height);
      const levels = context.getImageData(0, 0, small.width, small.height).data.filter((_, i) => i % 4 === 0).sort();
      factors.set(image, Math.min(Math.max(170 / (levels[Math.floor(levels.length * 0.99)] + 1), 1), 5));
    }
    return factors.get(image);
  }

  function ellipse(context, [u, v], [a, b], angle_deg) {
    context.beginPath();
    context.ellipse(u, v, a, b, angle_deg * Math.PI / 180, 0, 2 * Math.PI);
    context.stroke();
  }

  function cross(context, u, v, size) {
    context.beginPath();
    context.moveTo(u - size, v); context.lineTo(u + size, v);
    context.moveTo(u, v - size); context.lineTo(u, v + size);
    context.stroke();
  }

  function drawDots(context, trace, px) {
    const labelled = new Set(trace.labels.slot.filter((s) => s).map((s) => s.dot));
    trace.dots.u_px_q12.forEach((u, i) => {
      context.strokeStyle = labelled.has(i) ? "#5fd0ff" : "#ff6b6b";
      context.lineWidth = px;
      const radius = (labelled.has(i) ? 3.5 : 2) * px;
      ellipse(context, [u / 4096, trace.dots.v_px_q12[i] / 4096], [radius, radius], 0);
    });
  }

  function drawContours(context, trace, camera, range, px) {
    if (!trace.surface.valid) return;
    context.lineWidth = px;
    const front = trace.surface.nearest_mm_q8;
    for (const [i, cut] of trace.cuts.entries()) {
      /* Behind what may be a head every fifth will do: the cliff around it is steep. */
      if (cut.level_mm_q8 - front > HEAD_DEPTH_MM * 256 && i % 5 !== 0) continue;
      context.strokeStyle = Data.cssColour(Data.depthColour(cut.level_mm_q8 / 256, range));
      for (const contour of cut.contour) {
        context.beginPath();
        for (const [x, y] of contour.x_y_q9) {
          context.lineTo(...Data.gridPixel(camera, trace.surface.field, x / 512, y / 512));
        }
        if (contour.closed) context.closePath();
        context.stroke();
      }
    }
  }

  /* A slice's ellipse has the moments of a filled one: semi-axes of twice the standard deviation. */
  function drawSlice(context, slice, field, camera) {
    const [xx, xy, yy] = [slice.xx_q16, slice.xy_q16, slice.yy_q16].map((m) => m / 65536);
    const half = (xx - yy) / 2, root = Math.hypot(half, xy), mean = (xx + yy) / 2;
    const a = 2 * Math.sqrt(mean + root), b = 2 * Math.sqrt(Math.max(mean - root, 0));
    const angle = Math.atan2(2 * xy, xx - yy) / 2;
    context.beginPath();
    for (let i = 0; i < 48; i++) {
      const t = i / 48 * 2 * Math.PI, c = a * Math.cos(t), s = b * Math.sin(t);
      const x = slice.x_q16 / 65536 + c * Math.cos(angle) - s * Math.sin(angle);
      const y = slice.y_q16 / 65536 + c * Math.sin(angle) + s * Math.cos(angle);
      context.lineTo(...Data.gridPixel(camera, field, x, y));
    }
    context.closePath();
    context.stroke();
  }

  function drawNests(context, trace, camera, px) {
    if (!trace.surface.valid) return;
    context.strokeStyle = colour("nest");
    context.lineWidth = 1.2 * px;
    for (const nest of trace.hypotheses.nest) {
      for (const slice of nest.slice) {
        context.setLineDash(slice.whole ? [] : [2 * px, 3 * px]);
        drawSlice(context, slice, trace.surface.field, camera);
      }
    }
    context.setLineDash([]);
  }

  function label(context, text, u, v, px, fill) {
    context.font = `600 ${13 * px}px system-ui, sans-serif`;
    context.lineWidth = 3.5 * px;
    context.strokeStyle = "#000c";
    context.lineJoin = "round";
    context.strokeText(text, u, v);
    context.fillStyle = fill;
    context.fillText(text, u, v);
  }

  function drawHypotheses(context, record, px) {
    record.hypotheses.forEach((h, i) => {
      const isHead = i === record.head;
      const stroke = colour(h.rejected === null ? "selected" : "rejected");
      context.setLineDash(h.rejected === null ? (h.predicted ? [9 * px, 4 * px] : []) : [5 * px, 4 * px]);
      for (const [style, width] of [["#0009", 2.5], [stroke, 0]]) {
        context.strokeStyle = style;
        context.lineWidth = ((isHead ? 3.5 : i === chosen ? 3 : 1.6) + width) * px;
        ellipse(context, h.pixel, h.axes_px, h.angle_deg);
      }
      context.setLineDash([]);
      context.lineWidth = 2 * px;
      if (isHead) cross(context, ...h.pixel, 5 * px);
      label(context, `${i}`, h.pixel[0] + 7 * px, h.pixel[1] - 6 * px, px, stroke);
    });
  }

  function drawOther(context, frame, px) {
    const h = frame.otherSelected;
    if (!h) return;
    context.setLineDash([2 * px, 5 * px]);
    for (const [style, width] of [["#000c", 5.5], [colour("other"), 3]]) {
      context.strokeStyle = style;
      context.lineWidth = width * px;
      ellipse(context, h.pixel, h.axes_px, h.angle_deg);
    }
    context.setLineDash([]);
  }

  /* From a head's middle to where it looks; its end is 250 mm before it. */
  function drawDirections(context, record, camera, px) {
    for (const h of record.hypotheses) {
      const direction = Data.directionOf(h);
      if (!direction) continue;
      const ends = [0, 250].map((length) => h.centre_mm.map((mm, axis) => mm + length * direction[axis]));
      if (ends.some((end) => end[2] < 50)) continue;
      const [from, to] = ends.map(([x, y, z]) => Data.toPixel(camera, x / z, y / z));
      const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
      const barb = Math.min(12 * px, Math.hypot(to[0] - from[0], to[1] - from[1]) / 2);
      for (const [style, width] of [["#0009", 5.5], [colour("selected"), 3]]) {
        context.strokeStyle = style;
        context.lineWidth = width * px;
        context.beginPath();
        context.moveTo(...from);
        context.lineTo(...to);
        for (const side of [-0.5, 0.5]) {
          context.moveTo(...to);
          context.lineTo(to[0] - barb * Math.cos(angle + side), to[1] - barb * Math.sin(angle + side));
        }
        context.stroke();
      }
    }
  }

  function drawTruth(context, frame, camera, px) {
    const mm = Data.truthMm(frame);
    if (!mm) return;
    const [u, v] = Data.toPixel(camera, mm[0] / mm[2], mm[1] / mm[2]);
    for (const [style, width] of [["#000c", 5], ["#fff", 2]]) {
      context.strokeStyle = style;
      context.lineWidth = width * px;
      cross(context, u, v, 9 * px);
    }
  }

  /* In a corner an arrow to where up is; shorter, the more the camera looks down or up. */
  function drawUp(context, camera, px) {
    const m = camera.level_q30, up = [-m[3] / (1 << 30) * 30 * px, -m[4] / (1 << 30) * 30 * px];
    const at = [45 * px, 45 * px], side = [-up[1] * 0.2, up[0] * 0.2];
    context.strokeStyle = "#fff";
    context.lineWidth = 2 * px;
    context.beginPath();
    context.moveTo(at[0] - up[0], at[1] - up[1]);
    context.lineTo(at[0] + up[0], at[1] + up[1]);
    for (const sign of [-1, 1]) {
      context.moveTo(at[0] + up[0], at[1] + up[1]);
      context.lineTo(at[0] + up[0] * 0.6 + sign * side[0], at[1] + up[1] * 0.6 + sign * side[1]);
    }
    context.stroke();
    context.fillStyle = "#fff";
    context.font = `${12 * px}px sans-serif`;
    context.fillText("up", at[0] + side[0] * 3, at[1] + side[1] * 3);
  }

  function draw() {
    if (!shown) return;
    const { frame, trace, image } = shown;
    const camera = Data.dirs[frame.dir].camera;
    const scale = Math.max(1, Math.min(canvas.clientWidth * devicePixelRatio, 1600) / camera.width);
    canvas.width = Math.round(camera.width * scale);
    canvas.height = Math.round(camera.height * scale);
    const context = canvas.getContext("2d");
    const px = camera.width / (canvas.clientWidth || camera.width); /* a CSS pixel in the frame's */
    context.setTransform(scale, 0, 0, scale, scale / 2, scale / 2); /* pixel centres are whole numbers */
    context.fillStyle = "#0c0e11";
    context.fillRect(-0.5, -0.5, camera.width, camera.height);
    if (layers.image && image) {
      context.filter = layers.bright && !Data.dirs[frame.dir].range ? `brightness(${brightness(image).toFixed(2)})` : "none";
      context.drawImage(image, -0.5, -0.5, camera.width, camera.height);
      context.filter = "none";
    }
    if (trace) {
      const range = Data.depthRange(trace);
      if (layers.contours) drawContours(context, trace, camera, range, px);
      if (layers.dots) drawDots(context, trace, px);
      if (layers.nests) drawNests(context, trace, camera, px);
    }
    if (layers.hypotheses && frame.record.hypotheses) drawHypotheses(context, frame.record, px);
    if (layers.hypotheses && frame.record.hypotheses) drawDirections(context, frame.record, camera, px);
    if (layers.other) drawOther(context, frame, px);
    if (layers.truth) drawTruth(context, frame, camera, px);
    if (camera.level_q30) drawUp(context, camera, px);
  }

  function describe(frame) {
    const record = frame.record;
    if (record.error !== undefined) return `Frame ${record.file} could not be processed: ${record.error}`;
    const at = frame.selected ? `the head's ellipse at pixel ${frame.selected.pixel.join(", ")}` : "no head selected";
    const rejected = record.hypotheses.filter((h) => h.rejected !== null).length;
    return `Frame ${record.file}: ${record.dots} dots, ${record.labelled} labelled; ${at}; ` +
      `${record.hypotheses.length} hypotheses, ${rejected} rejected. The tables below have their values.`;
  }

  function show(frame, loaded, hypothesis) {
    shown = { frame, ...loaded };
    document.querySelector("[data-layer=bright]").parentElement.hidden = Data.dirs[frame.dir].range; /* depths need none */
    chosen = hypothesis;
    canvas.setAttribute("aria-label", describe(frame));
    draw();
  }
  function choose(hypothesis) { chosen = hypothesis; draw(); }

  for (const box of document.querySelectorAll("[data-layer]")) {
    layers[box.dataset.layer] = box.checked;
    box.addEventListener("change", () => { layers[box.dataset.layer] = box.checked; draw(); });
  }
  new ResizeObserver(draw).observe(canvas.parentElement);
  return { show, choose, draw };
})();
