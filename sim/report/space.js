"use strict";
/* space - points, surface and heads in 3-D (three.js). In the scene y is up and z towards the viewer: the
 * camera frame's x, -y, -z. */
const Space = (() => {
  const canvas = document.getElementById("space");
  const DISTANCE = 1250, WHOLE = 2200, AIM_BEHIND_MM = 400, ROTATION = Math.PI / 24; /* mm; radians per key */
  let renderer = null;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  } catch {
    document.getElementById("space-none").hidden = false;
    return { show() {}, choose() {}, theme() {}, draw() {} };
  }
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(40, 4 / 3, 20, 12000);
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.enableKeys = false; /* the keys of this page rotate */
  controls.enableZoom = false; /* until the view has the focus: a wheel is for the page first */
  controls.enablePan = false;
  controls.minDistance = 150;
  controls.maxDistance = 6000;
  scene.add(new THREE.AmbientLight(0xffffff, 0.75));
  const light = new THREE.DirectionalLight(0xffffff, 0.45);
  light.position.set(0.6, 1, 1.2);
  scene.add(light);

  const focus = new THREE.Vector3(); /* what is looked at, of a directory */
  const parts = {};
  const visible = {};
  function renew(name, object) {
    if (parts[name]) {
      scene.remove(parts[name]);
      parts[name].traverse((o) => {
        if (o.geometry && !o.isSprite) o.geometry.dispose(); /* sprites share theirs */
        if (o.material && o.material.map && o.material.map !== disc) o.material.map.dispose();
        if (o.material) o.material.dispose();
      });
    }
    parts[name] = object;
    object.visible = visible[name];
    scene.add(object);
  }

  const place = (x, y, z) => [x, -y, -z];

  function geometryOf(positions, colours) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    if (colours) geometry.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
    return geometry;
  }

  /* A round dot of any size: squares look like noise. */
  const disc = (() => {
    const dot = document.createElement("canvas");
    dot.width = dot.height = 32;
    const context = dot.getContext("2d");
    context.fillStyle = "#fff";
    context.arc(16, 16, 15, 0, 2 * Math.PI);
    context.fill();
    return new THREE.CanvasTexture(dot);
  })();

  function makePoints(points, range) {
    const positions = [], colours = [];
    points.state.forEach((state, i) => {
      if (state !== 1) return;
      const z = points.depth_mm_q8[i] / 256, q28 = 1 << 28;
      positions.push(...place(points.x_q28[i] / q28 * z, points.y_q28[i] / q28 * z, z));
      colours.push(...Data.depthColour(z, range));
    });
    const material = new THREE.PointsMaterial({ size: 20, vertexColors: THREE.VertexColors, map: disc, alphaTest: 0.5, transparent: true });
    return new THREE.Points(geometryOf(positions, colours), material);
  }

  /* A steep piece between a head and what is behind it stands for nothing that was seen, but is part of the
   * surface: it is drawn as it is. */
  function makeSurface(surface, range) {
    const group = new THREE.Group();
    if (!surface.valid) return group;
    const positions = [], colours = [], faces = [], lines = [], n = Data.NODES;
    surface.depth_mm_q8.forEach((row, y) => row.forEach((depth, x) => {
      const z = depth / 256, [u, v] = Data.fromGrid(surface.field, x, y), i = y * n + x;
      positions.push(...place(u * z, v * z, z));
      colours.push(...Data.depthColour(z, range));
      if (x + 1 < n && y + 1 < n) faces.push(i, i + n, i + 1, i + 1, i + n, i + n + 1);
      if (x + 1 < n && y % 2 === 0) lines.push(i, i + 1);
      if (y + 1 < n && x % 2 === 0) lines.push(i, i + n);
    }));
    const geometry = geometryOf(positions, colours);
    geometry.setIndex(faces);
    geometry.computeVertexNormals();
    const wires = geometryOf(positions, colours);
    wires.setIndex(lines);
    group.add(new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({
      vertexColors: THREE.VertexColors, side: THREE.DoubleSide, transparent: true, opacity: 0.55,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, depthWrite: false })));
    group.add(new THREE.LineSegments(wires, new THREE.LineBasicMaterial({
      vertexColors: THREE.VertexColors, transparent: true, opacity: 0.35 })));
    return group;
  }

  function makeEllipsoid(centre, semi, colour) {
    const mesh = new THREE.Mesh(new THREE.SphereBufferGeometry(1, 24, 16),
      new THREE.MeshBasicMaterial({ color: colour, wireframe: true, transparent: true, opacity: 0.5 }));
    mesh.scale.set(...semi);
    mesh.position.set(...place(...centre));
    return mesh;
  }

  const MEAN_SEMI = [80, 115, 95]; /* where no ellipsoid was fitted; mm */
  function makeHead(frame, trace, chosen) {
    const group = new THREE.Group();
    const hypotheses = frame.record.hypotheses || [];
    hypotheses.forEach((h, i) => {
      if (h.rejected !== null && i !== chosen) return;
      const detection = Data.dirs[frame.dir].paper ? null : trace.findings[i];
      const semi = detection ? detection.semi_mm_q8.map((v) => v / 256) : MEAN_SEMI;
      group.add(makeEllipsoid(Data.toLevel(Data.dirs[frame.dir].camera, h.centre_mm), semi, h.rejected === null ? 0x00c98d : 0xff9d2e));
      const direction = Data.directionOf(h);
      if (direction) {
        const [from, to] = [0, 1].map((length) => Data.toLevel(Data.dirs[frame.dir].camera, h.centre_mm.map((mm, axis) => mm + length * direction[axis])));
        group.add(new THREE.ArrowHelper(new THREE.Vector3(...place(...to.map((mm, axis) => mm - from[axis]))),
          new THREE.Vector3(...place(...from)), 250, 0x00c98d, 50, 30));
      }
    });
    return group;
  }

  function makeTruth(frame) {
    const group = new THREE.Group(), mm = Data.truthMm(frame);
    if (!mm) return group;
    const at = place(...Data.toLevel(Data.dirs[frame.dir].camera, mm)), positions = [];
    for (let axis = 0; axis < 3; axis++) {
      for (const sign of [-1, 1]) positions.push(...at.map((v, k) => (k === axis ? v + sign * 130 : v)));
    }
    const ink = getComputedStyle(document.documentElement).getPropertyValue("--scene-ink").trim();
    group.add(new THREE.LineSegments(geometryOf(positions), new THREE.LineBasicMaterial({ color: new THREE.Color(ink) })));
    return group;
  }

  /* A word that always faces the viewer. */
  function makeWord(text, at, colour) {
    const drawing = document.createElement("canvas");
    drawing.width = 256;
    drawing.height = 64;
    const context = drawing.getContext("2d");
    context.font = "600 40px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = colour;
    context.fillText(text, 128, 32);
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(drawing), transparent: true, depthTest: false }));
    sprite.scale.set(180, 45, 1);
    sprite.position.set(...at);
    return sprite;
  }

  /* Left below what is looked at: 200 mm along each axis with a tick at 100; and what the camera sees, from its centre on. */
  const AXIS_MM = 200, TICK_MM = 12, CORNER_MM = [-390, 60, -60];
  const AXES = [["x", 0xff8a80, "#ff8a80"], ["y", 0x8be28b, "#8be28b"], ["z", 0x8ab8ff, "#8ab8ff"]];
  function makeAxes(frame) {
    const group = new THREE.Group(), target = focus, c = Data.dirs[frame.dir].camera;
    const corner = [target.x, -target.y, -target.z].map((v, k) => v + CORNER_MM[k]);
    AXES.forEach(([name, hex, css], axis) => {
      const along = (mm, aside = 0) => {
        const step = Data.toLevel(c, [0, 1, 2].map((k) => k === axis ? mm : k === (axis + 1) % 3 ? aside : 0));
        return place(...corner.map((v, k) => v + step[k]));
      };
      const positions = [...along(0), ...along(AXIS_MM)];
      for (const tick of [AXIS_MM / 2, AXIS_MM]) positions.push(...along(tick, -TICK_MM), ...along(tick, TICK_MM));
      group.add(new THREE.LineSegments(geometryOf(positions), new THREE.LineBasicMaterial({ color: hex, depthTest: false, transparent: true })));
      group.add(makeWord(axis === 0 ? `x ${AXIS_MM} mm` : name, along(AXIS_MM + (axis === 0 ? 100 : 35)), css));
    });
    const far = -target.z, edge = [[0, 0], [c.width, 0], [c.width, c.height], [0, c.height]].map(([u, v]) =>
      place(...Data.toLevel(c, [(u - c.cx_px_q16 / 65536) / (c.fx_px_q16 / 65536) * far, (v - c.cy_px_q16 / 65536) / (c.fy_px_q16 / 65536) * far, far])));
    const positions = edge.flatMap((at, i) => [0, 0, 0, ...at, ...at, ...edge[(i + 1) % 4]]);
    group.add(new THREE.LineSegments(geometryOf(positions), new THREE.LineBasicMaterial({ color: 0xb9bec8, transparent: true, opacity: 0.5 })));
    group.add(makeWord("camera", [0, 45, 0], "#dfe3ea"));
    group.traverse((o) => { o.renderOrder = 1; }); /* over the surface, which is transparent too */
    return group;
  }

  const paper = matchMedia("print");
  function draw() {
    if (paper.matches) return; /* what is on the screen is printed */
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (width === 0) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
  }
  controls.addEventListener("change", draw);

  let shown = null, chosen = 0, dir = -1;

  /* The middle of what has colours: the person rather than the room. */
  function aim(trace) {
    const [near, far] = Data.depthRange(trace), at = parts.points.geometry.getAttribute("position"), q = [[], []];
    for (let i = 0; i < at.count; i++) {
      if (-at.getZ(i) < far) [at.getX(i), at.getY(i)].forEach((v, axis) => q[axis].push(v));
    }
    const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? 0;
    focus.set(median(q[0]), median(q[1]), -(near + AIM_BEHIND_MM));
  }

  function rotateTo(azimuth, elevation, distance = DISTANCE, at = focus) {
    controls.target.copy(at);
    const offset = new THREE.Vector3().setFromSpherical(new THREE.Spherical(distance, Math.PI / 2 - elevation, azimuth));
    camera.position.copy(controls.target).add(offset);
    controls.update();
    draw();
  }
  const home = () => rotateTo(0.45, 0.25);

  function rotateBy(azimuth, elevation, zoom) {
    const s = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
    const limit = Math.PI / 2 - 0.02;
    rotateTo(s.theta + azimuth, Math.min(Math.max(Math.PI / 2 - s.phi + elevation, -limit), limit), s.radius * zoom, controls.target.clone());
  }

  const moves = {
    ArrowLeft: [-ROTATION, 0, 1], ArrowRight: [ROTATION, 0, 1], ArrowUp: [0, ROTATION, 1], ArrowDown: [0, -ROTATION, 1],
    "+": [0, 0, 1 / 1.15], "=": [0, 0, 1 / 1.15], "-": [0, 0, 1.15],
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "0") home();
    else if (moves[event.key]) rotateBy(...moves[event.key]);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  canvas.addEventListener("focus", () => { controls.enableZoom = true; });
  canvas.addEventListener("blur", () => { controls.enableZoom = false; });

  function showScale(range) {
    const [from, to] = document.querySelectorAll("#scale b");
    from.textContent = `${range[0].toFixed(0)} mm`;
    to.textContent = `${range[1].toFixed(0)} mm and farther`;
    const stops = Data.STOPS.map((c) => `rgb(${c.join(" ")})`).join(", ");
    document.querySelector("#scale i").style.background = `linear-gradient(90deg, ${stops})`;
  }

  function describe(frame, trace) {
    if (!trace) return "Nothing to show: this frame could not be processed.";
    const head = frame.selected ? `the head's ellipsoid at ${frame.selected.centre_mm.join(", ")} mm` : "no head";
    return `3-D view: ${trace.points.seen_count} points, ${trace.surface.valid ? "the fitted surface" : "no surface"}, ${head}.`;
  }

  function build() {
    const { frame, trace } = shown;
    const range = trace ? Data.depthRange(trace) : null;
    renew("points", trace ? makePoints(trace.points, range) : new THREE.Group());
    renew("surface", trace ? makeSurface(trace.surface, range) : new THREE.Group());
    renew("head", trace ? makeHead(frame, trace, chosen) : new THREE.Group());
    renew("truth", makeTruth(frame));
    if (trace) showScale(range);
    if (trace && dir !== frame.dir) {
      dir = frame.dir;
      aim(trace);
      renew("axes", makeAxes(frame));
      home();
    }
    draw();
  }

  function show(frame, { trace }, hypothesis) {
    shown = { frame, trace };
    chosen = hypothesis;
    canvas.setAttribute("aria-label", describe(frame, trace));
    build();
  }
  function choose(hypothesis) {
    chosen = hypothesis;
    if (!shown || !shown.trace) return;
    renew("head", makeHead(shown.frame, shown.trace, chosen));
    draw();
  }
  function theme() {
    const ground = getComputedStyle(document.documentElement).getPropertyValue("--scene").trim();
    renderer.setClearColor(new THREE.Color(ground), 1);
    if (shown) renew("truth", makeTruth(shown.frame));
    draw();
  }

  for (const box of document.querySelectorAll("[data-part]")) {
    visible[box.dataset.part] = box.checked;
    box.addEventListener("change", () => {
      visible[box.dataset.part] = box.checked;
      if (parts[box.dataset.part]) parts[box.dataset.part].visible = box.checked;
      draw();
    });
  }
  document.getElementById("space-front").addEventListener("click", () => rotateTo(0, 0));
  document.getElementById("space-side").addEventListener("click", () => rotateTo(Math.PI / 2, 0));
  document.getElementById("space-top").addEventListener("click", () => rotateTo(0, Math.PI / 2 - 0.02));
  document.getElementById("space-camera").addEventListener("click", () => rotateTo(1.1, 0.3, WHOLE, focus.clone().multiplyScalar(0.55)));
  new ResizeObserver(draw).observe(canvas);
  theme();
  return { show, choose, theme, draw };
})();
