"use strict";
// The live view: asks for one frame after the other and draws it. What an answer is made of stands in
// app_live.h. Nothing is computed here that the board has not said, but for rates and the choice of the
// rejected hypothesis that was nearest to a head.

const RATE_S = 3; // rates are means over so many seconds
const RETRY_MS = 1000;
const BRIGHT_LEVEL = 170, BRIGHT_MAX = 5; // levels of 255; times
const element = (id) => document.getElementById(id);
const canvas = element("picture");
const context = canvas.getContext("2d");
const small = document.createElement("canvas"); // as it was sent
let last = null; // the frame that is drawn
const shown = []; // {frame, time_s of the board, at_s here} of the last frames

function parse(buffer) {
  const bytes = new Uint8Array(buffer);
  const first = bytes.indexOf(10);
  const second = bytes.indexOf(10, first + 1);
  const json = (from, to) => JSON.parse(new TextDecoder().decode(bytes.subarray(from, to)));
  const view = json(0, first);
  view.record = json(first + 1, second);
  view.samples = bytes.subarray(second + 1);
  view.columns = Math.floor(view.width / view.scale);
  view.rows = Math.floor(view.height / view.scale);
  if (view.samples.length !== view.columns * view.rows) {
    throw new Error(`${view.samples.length} samples, expected ${view.columns} x ${view.rows}`);
  }
  return view;
}

// What brings the brightest hundredth of the picture near to white: dots are dim, rooms dark.
function brightness(samples) {
  if (!element("bright").checked) return 1;
  const count = new Uint32Array(256);
  for (const sample of samples) count[sample]++;
  let level = 255;
  for (let above = count[255]; level > 0 && above < samples.length / 100; above += count[level]) level--;
  return Math.min(Math.max(BRIGHT_LEVEL / (level + 1), 1), BRIGHT_MAX);
}

function drawSamples(view) {
  const factor = brightness(view.samples);
  small.width = view.columns;
  small.height = view.rows;
  const image = context.createImageData(view.columns, view.rows);
  const out = new Uint32Array(image.data.buffer);
  for (let i = 0; i < out.length; i++) {
    out[i] = 0xff000000 | (Math.min(Math.round(view.samples[i] * factor), 255) * 0x010101);
  }
  small.getContext("2d").putImageData(image, 0, 0);
  context.drawImage(small, 0, 0, view.columns * view.scale, view.rows * view.scale);
}

function drawContours(view) {
  const levels = view.contours.map((contour) => contour.level_mm);
  const nearest = Math.min(...levels), farthest = Math.max(...levels);
  context.strokeStyle = "#35c2ff";
  for (const contour of view.contours) {
    const far = farthest > nearest ? (contour.level_mm - nearest) / (farthest - nearest) : 0;
    context.globalAlpha = 0.9 - 0.7 * far;
    context.beginPath();
    for (let i = 0; i < contour.px.length; i += 2) {
      context.lineTo(contour.px[i], contour.px[i + 1]);
    }
    if (contour.closed) context.closePath();
    context.stroke();
  }
  context.globalAlpha = 1;
}

function drawDots(view, unit) {
  const labelled = new Set(view.labelled);
  view.dots.forEach(([u, v], index) => {
    context.strokeStyle = labelled.has(index) ? "#ff3d9a" : "#ffffff";
    context.beginPath();
    context.arc(u, v, labelled.has(index) ? 2.5 * unit : unit, 0, 2 * Math.PI);
    context.stroke();
  });
}

function drawEllipse(hypothesis) {
  const [u, v] = hypothesis.pixel, [a, b] = hypothesis.axes_px;
  context.beginPath();
  context.ellipse(u, v, a, b, hypothesis.angle_deg * Math.PI / 180, 0, 2 * Math.PI);
  context.stroke();
}

// Where a face looks, as far as it is across the picture, from the head's centre on.
function drawArrow(hypothesis, unit) {
  const [yaw, pitch] = hypothesis.pose_deg.map((degrees) => degrees * Math.PI / 180);
  const [u, v] = hypothesis.pixel, reach = 1.6 * hypothesis.axes_px[0];
  const aside = reach * Math.sin(yaw) * Math.cos(pitch), down = -reach * Math.sin(pitch);
  const length = Math.hypot(aside, down), barb = Math.min(12 * unit, length / 2);
  const along = Math.atan2(down, aside);
  context.beginPath();
  context.arc(u, v, 3 * unit, 0, 2 * Math.PI);
  context.moveTo(u, v);
  context.lineTo(u + aside, v + down);
  for (const angle of [along + 2.6, along - 2.6]) {
    context.moveTo(u + aside, v + down);
    context.lineTo(u + aside + barb * Math.cos(angle), v + down + barb * Math.sin(angle));
  }
  for (const [width, style] of [[6, "#000"], [3, "#ffb000"]]) {
    context.lineWidth = width * unit;
    context.strokeStyle = style;
    context.stroke();
  }
}

// Below the place, where no arrow begins; upright, however the picture is rotated.
function drawText(text, [u, v], view, unit) {
  context.save();
  context.translate(u, v);
  context.rotate(-view.rotate_deg * Math.PI / 180);
  context.font = `bold ${16 * unit}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.lineWidth = 4 * unit;
  context.strokeStyle = "#000";
  context.strokeText(text, 0, 24 * unit);
  context.fillStyle = "#ffb000";
  context.fillText(text, 0, 24 * unit);
  context.restore();
}

function drawHypotheses(view, unit) {
  const heads = new Set(view.record.heads);
  view.record.hypotheses.forEach((hypothesis, index) => {
    const isHead = heads.has(index);
    if (!element(isHead ? "show-heads" : "show-others").checked) return;
    context.lineWidth = (isHead ? 3 : 1.5) * unit;
    context.strokeStyle = isHead ? "#ffb000" : "#ff8a5c";
    context.setLineDash(isHead ? [] : [6 * unit, 4 * unit]);
    drawEllipse(hypothesis);
    context.setLineDash([]);
    if (isHead) {
      if (hypothesis.pose_deg) drawArrow(hypothesis, unit);
      drawText(`${Math.round(hypothesis.distance_mm)} mm`, hypothesis.pixel, view, unit);
    }
  });
}

// From the frame's pixels to the canvas, by how far the picture is rotated.
const upright = ({ width, height, rotate_deg }) => ({
  0: [1, 0, 0, 1, 0, 0],
  90: [0, 1, -1, 0, height, 0],
  180: [-1, 0, 0, -1, width, height],
  270: [0, -1, 1, 0, 0, width],
}[rotate_deg]);

function draw() {
  if (last === null) return;
  const isAside = last.rotate_deg % 180 !== 0;
  const width = isAside ? last.height : last.width, height = isAside ? last.width : last.height;
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    canvas.style.setProperty("--ratio", `${width / height}`);
  }
  // A pixel of the screen in pixels of the frame, so that lines are as thick on a phone.
  const unit = Math.max(1, canvas.width / (canvas.clientWidth || canvas.width));
  context.setTransform(...upright(last));
  drawSamples(last);
  context.translate(0.5, 0.5); // a pixel's centre is at whole numbers
  context.lineWidth = unit;
  if (element("show-contours").checked && last.contours.length > 0) drawContours(last);
  if (element("show-dots").checked) drawDots(last, unit);
  drawHypotheses(last, unit);
}

function headText(record) {
  if (record.head === null) {
    return record.heads.length > 0 ? `${record.heads.length} found, none selected` : "none";
  }
  const head = record.hypotheses[record.head];
  const score = head.score === undefined ? "" : `, score ${head.score.toFixed(3)}`;
  const pose = head.pose_deg ? `, looks ${head.pose_deg.map((degrees) => degrees.toFixed(0)).join("° aside, ")}° up` : "";
  return `${head.distance_mm.toFixed(1)} mm away, centre ${head.centre_mm.map((mm) => mm.toFixed(1)).join(", ")} mm${score}${pose}` +
    (head.predicted ? ", predicted" : "");
}

function rejectedText(record) {
  const rejected = record.hypotheses.filter((hypothesis) => hypothesis.rejected !== null);
  if (rejected.length === 0) return "none";
  // In the record's order, which is the best first, where they have no score.
  const best = rejected.reduce((a, b) => ((b.score ?? -1) > (a.score ?? -1) ? b : a));
  const reason = best.rejected === "score" ? `score of ${best.score.toFixed(3)} too low` : `${best.rejected} out of its limits`;
  return `${reason}; ${best.distance_mm.toFixed(1)} mm away`;
}

function rigText(rig) {
  if (rig === undefined) return "–";
  const degrees = (values) => values.map((value) => value.toFixed(3)).join(", ");
  return {
    unknown: "too few dots to say",
    fits: "fits",
    moved: `moved by (${degrees(rig.rotation_deg)}) ± (${degrees(rig.sigma_deg)})°, focal length by ` +
      `${rig.focal_percent.toFixed(2)} %, picture by (${rig.shift_px.map((px) => px.toFixed(2)).join(", ")}) px; ${rig.depth_known ? "calibrate again" : "depth is not known: calibrate again"}`,
    lost: "does not fit: dots lie on none of its lines",
  }[rig.state];
}

function rateText(view) {
  const now = { frame: view.frame, time_s: view.record.time_us / 1e6, at_s: performance.now() / 1000 };
  shown.push(now);
  while (shown.length > 2 && (now.at_s - shown[0].at_s > RATE_S || shown[0].frame > now.frame)) shown.shift();
  const before = shown[0];
  const per = (count, duration_s) => (duration_s > 0 ? (count / duration_s).toFixed(1) : "–");
  return `${per(now.frame - before.frame, now.time_s - before.time_s)} frames/s on the board, ` +
    `${per(shown.length - 1, now.at_s - before.at_s)} here`;
}

function report(view) {
  const record = view.record;
  element("head").textContent = headText(record);
  element("rejected").textContent = rejectedText(record);
  element("dots").textContent = `${record.dots}, ${record.labelled} of 361 labelled`;
  element("rig").textContent = rigText(record.rig);
  element("rate").textContent = rateText(view);
  element("frame").textContent = record.file;
  canvas.setAttribute("aria-label", `camera image; head: ${headText(record)}`);
}

function say(text) {
  // Only what is new: a screen reader reads all that is set.
  if (element("state").textContent !== text) element("state").textContent = text;
}

const pause = (duration_ms) => new Promise((done) => setTimeout(done, duration_ms));
const drawn = () => new Promise((done) => requestAnimationFrame(done));

async function next() {
  const answer = await fetch("frame", { cache: "no-store" });
  if (answer.status === 204) {
    say("no new frame: is the camera there, and are the dots lit?");
    return;
  }
  if (!answer.ok) throw new Error(`the board answers ${answer.status}: is this the address it printed last?`);
  last = parse(await answer.arrayBuffer());
  draw();
  report(last);
  say("live");
  await drawn(); // a page that nobody sees asks for nothing
}

async function run() {
  for (;;) {
    try {
      await next();
    } catch (error) {
      say(`no connection to the board (${error.message}); trying again`);
      await pause(RETRY_MS);
    }
  }
}

for (const box of document.querySelectorAll("input")) box.addEventListener("change", draw);
addEventListener("resize", draw);
run();
