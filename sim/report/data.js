"use strict";
/* data - what host_sim wrote into this page (sim/sim_page.h), and the geometry of its integers. */
const Data = (() => {
  const NODES = 47, STEP = 10 / 11; /* of the surface's grid: nodes, and field units from one to the next */
  const KEPT = 12; /* frames whose trace and image stay decoded */
  const json = (name) => [...document.querySelectorAll(`script.${name}`)].map((e) => JSON.parse(e.textContent));
  const dirs = json("dir"), rows = json("row"), [run] = json("run");
  const MATCH_MM = 100; /* as far as a head may be from another to be the same (docs/contract.md, "Score") */
  const stem = (name) => name.replace(/\.[^.]*$/, "");

  /* Records of the run that this one is compared with, by the last part of their directory and their frame's name. */
  const last = (path) => path.replace(/\/+$/, "").split("/").pop();
  const others = new Map(json("other").map((o) => [`${last(o.dir ?? "")}/${stem(o.file)}`, o]));
  const otherOf = (frame) => others.get(`${last(dirs[frame.dir].path)}/${stem(frame.record.file)}`) ?? others.get(`/${stem(frame.record.file)}`) ?? null;
  const selectedOf = (record) => record.hypotheses && record.head !== null ? record.hypotheses[record.head] : null;
  const apartMm = (a, b) => Math.hypot(...a.map((v, k) => v - b[k]));

  /* A frame's trace and image follow its own element, unless it was lost. */
  const frames = [...document.querySelectorAll("script.frame")].map((element, index) => {
    const frame = JSON.parse(element.textContent);
    const trace = element.nextElementSibling;
    if (trace && trace.classList.contains("trace")) {
      frame.traceElement = trace;
      frame.imageElement = trace.nextElementSibling;
    }
    const record = frame.record;
    frame.index = index;
    frame.selected = selectedOf(record);
    frame.other = otherOf(frame);
    frame.otherSelected = frame.other ? selectedOf(frame.other) : null;
    frame.link = `#${encodeURIComponent(dirs[frame.dir].label)}/${encodeURIComponent(stem(record.file))}`;
    return frame;
  });
  let first = {};
  for (const frame of frames) {
    if (first.dir !== frame.dir) first = frame;
    frame.time_s = frame.record.time_us === undefined ? null : frame.record.time_us / 1e6;
    frame.inDir = frame.index - first.index;
    dirs[frame.dir].first ??= frame.index;
    dirs[frame.dir].count = frame.inDir + 1;
  }

  function bytesOf(element) {
    const text = atob(element.textContent);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes;
  }

  async function decodeTrace(frame) {
    const stream = new Blob([bytesOf(frame.traceElement)]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).json();
  }

  async function decode(frame) {
    if (!frame.traceElement) return { trace: null, image: null };
    const hasImage = frame.imageElement.textContent !== "";
    const [trace, image] = await Promise.all([
      decodeTrace(frame),
      hasImage ? createImageBitmap(new Blob([bytesOf(frame.imageElement)], { type: "image/jpeg" })) : null,
    ]);
    return { trace, image };
  }

  const kept = new Map();
  /* A promise of {trace, image}, both null of a frame that was lost. */
  function load(index) {
    let promise = kept.get(index);
    if (promise) kept.delete(index); /* entered anew: the last one used is the last one dropped */
    else promise = decode(frames[index]);
    kept.set(index, promise);
    if (kept.size > KEPT) {
      const oldest = kept.keys().next().value;
      kept.get(oldest).then(({ image }) => image && image.close());
      kept.delete(oldest);
    }
    return promise;
  }

  /* Normalised coordinates to pixels of the frame, through the lens (OpenCV's model). */
  function toPixel(camera, x, y) {
    const q24 = 1 << 24, q16 = 65536;
    const r2 = x * x + y * y;
    const k = 1 + r2 * (camera.k1_q24 + r2 * (camera.k2_q24 + r2 * camera.k3_q24)) / q24;
    const p1 = camera.p1_q24 / q24, p2 = camera.p2_q24 / q24;
    const xd = x * k + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    const yd = y * k + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    return [(camera.fx_px_q16 * xd + camera.cx_px_q16) / q16, (camera.fy_px_q16 * yd + camera.cy_px_q16) / q16];
  }

  /* Where the camera does not hang level, what looks for heads works in a frame that does (ih_level.h): a vector to it, and
   * back. */
  function toLevel(camera, v) {
    const m = camera.level_q30;
    return m ? [0, 3, 6].map((i) => (m[i] * v[0] + m[i + 1] * v[1] + m[i + 2] * v[2]) / (1 << 30)) : v;
  }
  function fromLevel(camera, v) {
    const m = camera.level_q30;
    return m ? [0, 1, 2].map((i) => (m[i] * v[0] + m[i + 3] * v[1] + m[i + 6] * v[2]) / (1 << 30)) : v;
  }

  /* A position on the grid to pixels. */
  function gridPixel(camera, field, x, y) {
    const [u, v, depth] = fromLevel(camera, [...fromGrid(field, x, y), 1]);
    return toPixel(camera, u / depth, v / depth);
  }

  /* A position on the grid, in steps, to normalised coordinates. */
  function fromGrid(field, x, y) {
    const q28 = 1 << 28, unit = field.unit_q28 * STEP, middle = (NODES - 1) / 2;
    return [(field.centre_x_q28 + (x - middle) * unit) / q28, (field.centre_y_q28 + (y - middle) * unit) / q28];
  }

  const COLOUR_MM = 600; /* a person's depth; walls behind need no colours of their own */
  /* The depths between which a frame's colours run: from its nearest point on. */
  function depthRange(trace) {
    const depths = trace.points.depth_mm_q8.filter((_, i) => trace.points.state[i] === 1).map((d) => d / 256);
    if (depths.length === 0) return [500, 500 + COLOUR_MM];
    const near = Math.min(...depths);
    return [near, near + COLOUR_MM];
  }

  /* Near is yellow, far is violet, in equal steps of brightness (viridis). 0..1 each. */
  const STOPS = [[253, 231, 37], [122, 209, 81], [34, 168, 132], [42, 120, 142], [65, 68, 135], [84, 30, 110]];
  function depthColour(depth, [near, far]) {
    const at = Math.min(Math.max((depth - near) / (far - near), 0), 1) * (STOPS.length - 1);
    const i = Math.min(Math.floor(at), STOPS.length - 2), part = at - i;
    return STOPS[i].map((c, k) => (c + (STOPS[i + 1][k] - c) * part) / 255);
  }
  const cssColour = (rgb) => `rgb(${rgb.map((c) => Math.round(c * 255)).join(" ")})`;

  /* In words: what came of a frame. */
  function state(frame) {
    if (frame.record.error !== undefined) return "lost";
    if (!frame.verdict) return frame.selected ? "head" : "none";
    return frame.verdict.selected_right ? "right" : "wrong";
  }

  /* Where the face looks, a unit vector of the camera frame; null where it is not known. */
  function directionOf(hypothesis) {
    if (!hypothesis.pose_deg) return null;
    const [yaw, pitch] = hypothesis.pose_deg.map((degrees) => degrees * Math.PI / 180);
    return [Math.sin(yaw) * Math.cos(pitch), -Math.sin(pitch), -Math.cos(yaw) * Math.cos(pitch)];
  }

  const truthMm = (frame) => frame.truth && frame.truth.head ? frame.truth.centre_mm_q8.map((v) => v / 256) : null;

  /* Was the other run right in a frame? null where nobody knows. */
  function otherRight(frame) {
    if (!frame.other || !frame.truth) return null;
    const mm = truthMm(frame), head = frame.otherSelected;
    return frame.other.error === undefined && (mm ? head !== null && apartMm(mm, head.centre_mm) <= MATCH_MM : head === null);
  }
  /* Another head, or none, in the other run. */
  function differs(frame) {
    if (!frame.other) return false;
    const [a, b] = [frame.selected, frame.otherSelected];
    return a && b ? apartMm(a.centre_mm, b.centre_mm) > MATCH_MM : Boolean(a) !== Boolean(b);
  }

  return { run, others, apartMm, otherRight, differs, dirs, rows, frames, load, toPixel, toLevel, fromGrid, gridPixel, depthRange, depthColour, cssColour, state, directionOf, truthMm, NODES, STOPS };
})();
