"use strict";
/* page - which frame is shown, and everything that chooses it. */
(() => {
  const PLAY_MS = 120; /* a frame, at least */
  const by = (id) => document.getElementById(id);
  const { frames, dirs } = Data;
  const slider = by("slider"), now = by("now");
  let current = 0, chosen = 0, dir = -1, playing = false, loaded = { trace: null, image: null };

  const stateText = { right: "right", wrong: "not right", lost: "lost", head: "head", none: "no head" };

  function mm(values) {
    return values.map((v, i) => `${"xyz"[i]}\u00a0${v.toFixed(1)}`).join(", ");
  }

  const capital = (text) => text[0].toUpperCase() + text.slice(1);

  function headText(record, selected) {
    const score = selected && selected.score !== undefined ? `, score\u00a0${selected.score.toFixed(3)}` : "";
    const pose = selected && selected.pose_deg
      ? `, looks ${selected.pose_deg.map((v, i) => `${v.toFixed(0)} ± ${selected.pose_sigma_deg[i].toFixed(0)}°`).join(" aside, ")} up` : "";
    return selected ? `head at ${mm(selected.centre_mm)}\u00a0mm${selected.predicted ? " (predicted)" : ""}${score}${pose}`
      : record.heads.length > 1 ? `${record.heads.length} heads, none selected` : "no head";
  }

  /* What came of the frame, as a sentence: the live region. */
  function sentence(frame) {
    const record = frame.record;
    if (record.error !== undefined) return `Lost: ${record.error}`;
    const head = headText(record, frame.selected), v = frame.verdict;
    if (!v) return `${capital(head)}.`;
    if (v.selected_right) return `Right: ${head}${v.error_mm !== undefined ? `, ${v.error_mm}\u00a0mm from the true centre` : ", and nobody is there"}.`;
    const off = frame.selected && v.head_there ? Data.apartMm(frame.selected.centre_mm, Data.truthMm(frame)).toFixed(0) : 0;
    return `Not right: ${head}, but ${!v.head_there ? "nobody is there" : frame.selected ? `the true one is ${off}\u00a0mm away` : "there is one"}.`;
  }

  /* The same of the run that this one is compared with. */
  function otherText(frame) {
    const record = frame.other;
    if (Data.others.size === 0) return "";
    if (!record) return "The other run has no such frame.";
    if (record.error !== undefined) return `The other run lost it: ${record.error}`;
    const right = Data.otherRight(frame), there = frame.otherSelected;
    const apart = frame.selected && there ? `, ${Data.apartMm(frame.selected.centre_mm, there.centre_mm).toFixed(0)}\u00a0mm from this one` : "";
    return `The other run: ${headText(record, there)}${apart}${right === null ? "" : right ? ": right" : ": not right"}.`;
  }

  /* How the rig has moved against its file. */
  function rigText(rig) {
    const degrees = (values) => values.map((v) => v.toFixed(3)).join(", ");
    const across = rig.across_px === null ? "" : `; dots lie ${rig.across_px.toFixed(2)} px beside their lines`;
    return {
      unknown: "Rig: too few dots to say whether it fits",
      fits: `Rig: fits${across}`,
      moved: `Rig: has moved, the projector by (${degrees(rig.rotation_deg)}) ± (${degrees(rig.sigma_deg)})° about X, Y, Z, ` +
        `the focal length by ${rig.focal_percent.toFixed(2)} %, the picture by (${rig.shift_px.map((v) => v.toFixed(2)).join(", ")}) px${across}; depth is ${rig.depth_known ? "" : "not "}known`,
      lost: "Rig: does not fit, dots lie on none of its lines",
    }[rig.state];
  }

  function reportRig(rig) {
    by("rig").textContent = rig ? rigText(rig) : "";
    by("rig").className = rig && (rig.state === "moved" || rig.state === "lost") ? "quiet moved" : "quiet";
  }

  function report(frame) {
    reportRig(frame.record.rig);
    const state = Data.state(frame);
    const tag = Tables.element("strong", { class: `verdict ${state === "right" ? "good" : state === "wrong" || state === "lost" ? "bad" : ""}` }, sentence(frame));
    const other = otherText(frame);
    now.replaceChildren(tag, " ", Tables.element("span", { class: "quiet" }, `Frame ${frame.index + 1} of ${frames.length}, `,
      Tables.element("a", { href: frame.link, title: "The link to this frame" }, `${dirs.length > 1 ? `${dirs[frame.dir].label}/` : ""}${frame.record.file}`),
      other ? `. ${other}` : ""));
    slider.setAttribute("aria-valuetext", `${frame.index + 1} of ${frames.length}, ${stateText[state]}`);
  }

  function choose(index) {
    const count = (frames[current].record.hypotheses || []).length;
    chosen = count === 0 ? 0 : (index + count) % count;
    const focused = document.activeElement && document.activeElement.closest("#hypotheses");
    Tables.fillHypotheses(frames[current], chosen, choose);
    if (focused) by("hypotheses").querySelectorAll("button")[chosen].focus();
    Tables.fillEvidence(frames[current], loaded.trace, chosen);
    Picture.choose(chosen);
    Space.choose(chosen);
  }

  function showDir(frame) {
    if (dir === frame.dir) return;
    dir = frame.dir;
    const own = dirs[dir];
    by("path-dir").textContent = dirs.length > 1 ? `in ${own.label}` : "";
    by("dir").value = `${dir}`;
    document.documentElement.style.setProperty("--ratio", `${own.camera.width / own.camera.height}`);
    Charts.show(frames.slice(own.first, own.first + own.count), go);
  }

  let requested = 0;
  async function go(index) {
    const frame = frames[Math.min(Math.max(index, 0), frames.length - 1)];
    current = frame.index;
    slider.value = `${current}`;
    if (location.hash !== frame.link) history.replaceState(null, "", frame.link);
    report(frame);
    showDir(frame);
    Charts.mark(frame.inDir);
    const mine = ++requested;
    const next = await Data.load(current);
    if (mine !== requested) return; /* another one was requested meanwhile */
    loaded = next;
    chosen = frame.selected ? frame.record.head : 0;
    Picture.show(frame, loaded, chosen);
    Space.show(frame, loaded, chosen);
    Tables.fillHypotheses(frame, chosen, choose);
    Tables.fillEvidence(frame, loaded.trace, chosen);
    Tables.fillNests(frame, loaded.trace);
    by("record").textContent = JSON.stringify(frame.record);
    document.documentElement.dataset.shown = `${current}`;
    if (current + 1 < frames.length) Data.load(current + 1);
  }

  /* The next frame that is not right, in a direction; where nothing is scored, that has no head. */
  function goWrong(step) {
    const states = frames.some((f) => f.verdict) ? ["wrong", "lost"] : ["none", "lost"];
    for (let i = current + step; i >= 0 && i < frames.length; i += step) {
      if (states.includes(Data.state(frames[i]))) { go(i); return; }
    }
    const sought = states.includes("wrong") ? "not right" : "without a head";
    now.append(Tables.element("span", { class: "quiet" }, ` (no ${step > 0 ? "later" : "earlier"} frame is ${sought})`));
  }

  function goDifferent(step) {
    for (let i = current + step; i >= 0 && i < frames.length; i += step) {
      if (Data.differs(frames[i])) { go(i); return; }
    }
    now.append(Tables.element("span", { class: "quiet" }, " (no later frame is different)"));
  }

  /* The frame that the address names, or -1. */
  function linked() {
    return frames.findIndex((f) => f.link === location.hash || decodeURIComponent(f.link) === location.hash);
  }

  async function play() {
    playing = !playing;
    by("play").setAttribute("aria-pressed", `${playing}`);
    by("play").firstElementChild.textContent = playing ? "❚❚ Stop" : "▶︎ Play";
    now.setAttribute("aria-live", playing ? "off" : "polite");
    if (playing && current === frames.length - 1) await go(0);
    while (playing && current < frames.length - 1) {
      await Promise.all([go(current + 1), new Promise((resolve) => { setTimeout(resolve, PLAY_MS); })]);
    }
    if (playing) play();
  }

  const keys = {
    ArrowLeft: () => go(current - 1), ArrowRight: () => go(current + 1),
    n: () => goWrong(1), d: () => goDifferent(1), p: () => goWrong(-1), h: () => choose(chosen + 1),
  };
  /* Elsewhere these scroll the page. */
  const sliderKeys = {
    PageUp: () => go(current - 10), PageDown: () => go(current + 10), Home: () => go(0), End: () => go(frames.length - 1), " ": play,
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const at = event.target;
    /* What the focused element does with a key itself; a list of choices goes to the one with that letter. */
    if (at.matches("select")) return;
    if (at.matches("input[type=checkbox], summary, button, .scroll, pre") && (event.key.length > 1 || event.key === " ")) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const key = keys[name] || (at === slider ? sliderKeys[name] : undefined);
    if (!key) return;
    event.preventDefault();
    key();
  });

  /* Right or not, below the slider. */
  function fillStrip() {
    const colours = { right: "var(--good)", wrong: "var(--bad)", lost: "var(--ink)", head: "var(--accent)", none: "var(--line)" };
    const stops = frames.flatMap((f, i) => {
      const c = colours[Data.state(f)];
      return [`${c} ${(i / frames.length * 100).toFixed(3)}%`, `${c} ${((i + 1) / frames.length * 100).toFixed(3)}%`];
    });
    by("strip").style.background = `linear-gradient(90deg, ${stops.join(",")})`;
    const count = (state) => frames.filter((f) => Data.state(f) === state).length;
    by("strip-text").textContent = Object.keys(stateText).filter(count).map((s) => `${count(s)} frames ${stateText[s]}`).join(", ");
  }

  /* The one sentence about all frames. */
  function fillSummary() {
    const count = (n, one, many) => `${n} ${n === 1 ? one : many}`;
    const scored = frames.filter((f) => f.verdict), right = scored.filter((f) => f.verdict.selected_right).length;
    const found = frames.filter((f) => f.selected).length;
    const both = scored.filter((f) => f.other), better = both.filter((f) => Data.otherRight(f) === false && f.verdict.selected_right).length;
    const worse = both.filter((f) => Data.otherRight(f) && !f.verdict.selected_right).length;
    by("summary").textContent = (scored.length > 0 ? `${right} of ${count(scored.length, "frame is", "frames are")} right`
      : `a head in ${found} of ${count(frames.length, "frame", "frames")}`) + (dirs.some((d) => d.paper) ? ", the paper’s method alone" : "") +
      (Data.others.size === 0 ? "" : `; against ${Data.run.against}: ${both.length > 0 ? `${better} better, ${worse} worse, ` : ""}` +
        `${count(frames.filter(Data.differs).length, "head differs", "heads differ")}`) + ".";
    for (const e of document.querySelectorAll(".with-truth")) e.hidden = scored.length === 0;
    for (const e of document.querySelectorAll(".with-other")) e.hidden = Data.others.size === 0;
    if (scored.length === 0) {
      for (const e of document.querySelectorAll(".not-right")) e.textContent = "without a head";
      by("next-wrong").title = "Next frame without a head (N)";
    }
  }

  /* Which run this is. */
  function fillRun() {
    const quote = (word) => /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
    by("command").textContent = ["host_sim", ...Data.run.command.map(quote)].join(" ");
    const cameraText = (d) => `${d.camera.width} × ${d.camera.height} px, focal length ${(d.camera.fx_px_q16 / 65536).toFixed(1)} px, ` +
      `${d.range ? "depth image" : "laser dots"}, working range ${d.near_mm} to ${d.far_mm} mm`;
    const rows = [["Version", `isohead ${Data.run.version}`],
      ...dirs.map((d) => [`${d.path}`, `${d.count ?? 0} frames; ${d.rig}; ${cameraText(d)}`])];
    by("run-values").replaceChildren(...rows.flatMap(([name, value]) => [Tables.element("dt", {}, name), Tables.element("dd", {}, value)]));
  }

  function fillDirs() {
    by("dir-choice").hidden = dirs.length < 2;
    dirs.forEach((d, i) => { if (d.count) by("dir").append(Tables.element("option", { value: `${i}` }, d.label)); });
    by("dir").addEventListener("change", (event) => go(dirs[Number(event.target.value)].first));
  }

  function theme() {
    Charts.theme();
    Space.theme();
    Picture.draw();
  }

  if (!("DecompressionStream" in window)) {
    by("summary").textContent = "This browser is too old for this page: it cannot unpack the frames. Firefox 113, Chrome 80, Safari 16.4 can.";
    return;
  }
  Tables.fillTable1();
  fillSummary();
  fillRun();
  by("main").hidden = frames.length === 0;
  if (frames.length === 0) return;
  slider.max = `${frames.length - 1}`;
  slider.addEventListener("input", () => go(Number(slider.value)));
  by("previous").addEventListener("click", () => go(current - 1));
  by("next").addEventListener("click", () => go(current + 1));
  by("next-wrong").addEventListener("click", () => goWrong(1));
  by("next-other").addEventListener("click", () => goDifferent(1));
  by("play").addEventListener("click", play);
  addEventListener("hashchange", () => { if (linked() >= 0) go(linked()); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", theme);
  matchMedia("print").addEventListener("change", theme);
  fillStrip();
  fillDirs();
  Space.theme();
  const first = linked() >= 0 ? linked() : frames.findIndex((f) => f.selected);
  go(first < 0 ? 0 : first);
})();
