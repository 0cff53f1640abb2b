// Time, pointer and keyboard; the energy plot; legend and contact list.
const energy = $("energy"), energyContext = energy.getContext("2d");
const total = view.kinetic.map((t, k) => t === null || view.potential[k] === null ? null : t + view.potential[k]);
const curves = [["kinetic", view.kinetic, 0], ["potential", view.potential, 1], ["total", total, 2]];
const start = view.time[0] ?? 0, end = view.time[view.time.length - 1] ?? 0;
const margin = {left: 64, right: 14, top: 7, bottom: 34};
// Text of the page and not of the canvas: it wraps where the screen is narrow.
const readings = curves.map(([name, , colour]) => {
  const entry = document.createElement("span"), mark = document.createElement("i"), text = document.createElement("b");
  mark.style.borderColor = `var(--series-${colour})`;
  entry.append(mark, text);
  $("energy-key").append(entry);
  return text;
});
// In a page with other content the player keeps to itself.
const part = document.querySelector(".view.part");
if (part) stage.tabIndex = 0;
let frame = 0, clock = start, playing = false, hovered = -1, before = 0, fitted = true;

function energyMap() {
  let low = Infinity, high = -Infinity;
  for (const [, values] of curves) {
    for (const v of values) if (v !== null) { low = Math.min(low, v); high = Math.max(high, v); }
  }
  if (!(low <= high)) { low = 0; high = 1; }
  const pad = Math.max(0.06 * (high - low), 1e-9 * Math.max(1, Math.abs(high)));
  low -= pad; high += pad;
  const w = energy.clientWidth - margin.left - margin.right, h = energy.clientHeight - margin.top - margin.bottom;
  const span = end > start ? end - start : 1;
  return {low, high, w, h, span, x: (t) => margin.left + w * (t - start) / span,
          y: (e) => margin.top + h * (high - e) / (high - low)};
}
function drawEnergy() {
  const g = energyContext, ratio = devicePixelRatio || 1, map = energyMap();
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, energy.clientWidth, energy.clientHeight);
  g.font = "11px system-ui, sans-serif"; g.lineWidth = 1; g.strokeStyle = colours.grid; g.fillStyle = colours.muted;
  g.textAlign = "right"; g.textBaseline = "middle";
  const dy = tickStep(map.high - map.low, 4), dx = tickStep(map.span, Math.max(3, map.w / 90));
  for (let i = Math.ceil(map.low / dy); i * dy <= map.high; i++) {
    line(g, [margin.left, map.y(i * dy)], [margin.left + map.w, map.y(i * dy)]);
    g.fillText(tickText(i * dy, dy), margin.left - 7, map.y(i * dy));
  }
  g.textAlign = "center"; g.textBaseline = "top";
  for (let i = Math.ceil(start / dx - 1e-9); i * dx <= start + map.span * (1 + 1e-9); i++) {
    line(g, [map.x(i * dx), margin.top], [map.x(i * dx), margin.top + map.h]);
    g.fillText(tickText(i * dx, dx), map.x(i * dx), margin.top + map.h + 5);
  }
  g.textBaseline = "alphabetic";
  g.fillText("time (s)", margin.left + map.w / 2, energy.clientHeight - 4);
  for (const [name, values, colour] of curves) {
    g.strokeStyle = colours.series[colour]; g.lineWidth = 1.8; g.lineJoin = "round";
    g.beginPath();
    let open = false;
    values.forEach((v, k) => {
      if (v === null) { open = false; return; }
      if (open) g.lineTo(map.x(view.time[k]), map.y(v)); else g.moveTo(map.x(view.time[k]), map.y(v));
      open = true;
    });
    g.stroke();
    readings[colour].textContent =
        values.length && values[frame] !== null ? `${name} ${values[frame].toPrecision(5)} J` : name;
  }
  if (!view.time.length) return;
  const x = map.x(view.time[frame]);
  g.strokeStyle = colours.text; g.lineWidth = 1; line(g, [x, margin.top], [x, margin.top + map.h]);
  for (const [, values, colour] of curves) {
    if (values[frame] === null) continue;
    g.fillStyle = colours.series[colour]; disc(g, [x, map.y(values[frame])], 3.2); g.fill();
  }
}

function cell(row, text, kind) {
  const td = document.createElement("td");
  td.textContent = text;
  if (kind) td.className = kind;
  row.append(td);
  return td;
}
const bodyName = (i) => i >= 0 && i < view.bodies.length ? view.bodies[i].name : "world";
function listContacts() {
  const all = view.contacts[frame] || [], rows = $("contact-rows");
  rows.replaceChildren();
  $("contact-count").textContent = all.length ? `(${all.length})` : "(none)";
  for (const c of all.slice(0, 30)) {
    const row = document.createElement("tr"), mode = view.modes[c[8]], mark = document.createElement("i");
    mark.style.background = modeColour(mode);
    cell(row, `${bodyName(c[0])}, ${bodyName(c[1])}`).prepend(mark);
    cell(row, c[6] === null ? "–" : c[6].toPrecision(3), "number");
    cell(row, c[7] === null ? "–" : c[7].toPrecision(3), "number");
    row.title = mode;
    rows.append(row);
  }
}
function legend() {
  const box = $("legend"), items = [];
  const add = (text, draw) => items.push([text, draw]);
  const swatch = (body) => (g) => {
    g.fillStyle = body.colour < 0 ? hatch(g, colours.muted) : bodyColour(body);
    g.strokeStyle = bodyColour(body); g.globalAlpha = body.colour < 0 ? 1 : 0.3;
    g.fillRect(4, 2, 22, 14); g.globalAlpha = 1; g.lineWidth = 1.5;
    if (body.motion === "kinematic") g.setLineDash([4, 3]);
    g.strokeRect(4, 2, 22, 14);
  };
  for (const [kind, text] of [["moving", "moving body"], ["kinematic", "kinematic body"], ["static", "static body"]]) {
    const body = view.bodies.find((b) => b.motion === kind);
    if (body) add(text, swatch(body));
  }
  const joints = {revolute: (g) => { g.strokeStyle = colours.text; disc(g, [15, 9], 3.6); g.stroke(); },
                  weld: (g) => { g.fillStyle = colours.text; g.fillRect(11, 5, 8, 8); },
                  prismatic: (g) => { g.strokeStyle = colours.text; g.strokeRect(10, 4, 10, 10); g.setLineDash([4, 3]);
                                      line(g, [1, 9], [29, 9]); },
                  distance: (g) => { g.strokeStyle = g.fillStyle = colours.text; line(g, [5, 9], [25, 9]);
                                     for (const x of [5, 25]) { disc(g, [x, 9], 3); g.fill(); } },
                  rope: (g) => { g.strokeStyle = g.fillStyle = colours.text; g.beginPath(); g.moveTo(5, 5);
                                 g.quadraticCurveTo(15, 18, 25, 5); g.stroke();
                                 for (const x of [5, 25]) { disc(g, [x, 5], 2.2); g.fill(); } },
                  fixed_angle: (g) => { g.strokeStyle = colours.text; g.setLineDash([2, 4]); line(g, [2, 9], [28, 9]); }};
  joints.coupling = joints.fixed_angle;
  for (const type of Object.keys(joints)) {
    if (view.joints.some((joint) => joint.type === type)) add(type === "coupling" ? type : type.replace("_", " ") + " joint", joints[type]);
  }
  if (view.joints.some((joint) => joint.motor)) {
    add("motor", (g) => { g.strokeStyle = colours.text; disc(g, [15, 9], 7); g.stroke(); });
  }
  if (view.joints.some((joint) => joint.servo)) {
    add("servo", (g) => { g.strokeStyle = colours.text; drawServo(g, [15, 10]); });
  }
  if (view.bodies.some((body) => body.support_radius)) {
    add("stands on this disc", (g) => {
      g.strokeStyle = colours.text; g.lineWidth = 1.2; g.setLineDash([2, 3]); disc(g, [15, 9], 7); g.stroke();
    });
  }
  if (view.bodies.some((body) => body.support && body.support.length)) {
    add("stands on this point", (g) => {
      g.strokeStyle = colours.text; g.lineWidth = 1.2; line(g, [11, 5], [19, 13]); line(g, [11, 13], [19, 5]);
    });
  }
  if (marks.length) {
    add("observed", (g) => { g.strokeStyle = colours.text; g.lineWidth = 1.6; line(g, [10, 9], [20, 9]); line(g, [15, 4], [15, 14]); });
    add("fitted − observed", (g) => { g.lineWidth = 2; g.strokeStyle = g.fillStyle = colours.series[4]; arrow(g, [2, 9], [28, 9]); });
  }
  if (view.springs.length) {
    add("spring", (g) => {
      g.strokeStyle = colours.series[5]; g.lineWidth = 1.6; g.beginPath(); g.moveTo(1, 9);
      for (let i = 0; i < 7; i++) g.lineTo(5 + 3.3 * i, i % 2 ? 4 : 14);
      g.lineTo(29, 9); g.stroke();
    });
  }
  view.modes.forEach((mode) => add("contact: " + mode.replace(/_/g, " "), (g) => {
    g.fillStyle = modeColour(mode); disc(g, [15, 9], 4.2); g.fill();
  }));
  if (impulseMax > 0) {
    for (const [text, colour] of [["normal impulse", 4], ["tangential impulse", 3]]) {
      add(text, (g) => { g.lineWidth = 2.2; g.strokeStyle = g.fillStyle = colours.series[colour]; arrow(g, [2, 9], [28, 9]); });
    }
  }
  box.replaceChildren();
  for (const [text, draw] of items) {
    const row = document.createElement("div"), icon = document.createElement("canvas"), g = icon.getContext("2d");
    const ratio = devicePixelRatio || 1;
    icon.width = 30 * ratio; icon.height = 18 * ratio; g.scale(ratio, ratio);
    draw(g);
    row.append(icon, text);
    box.append(row);
  }
  $("impulse-scale").textContent = impulseMax > 0
      ? `Arrows show the impulse on the first body; length ∝ √impulse, the longest ${impulseMax.toPrecision(3)} N s.` : "";
}

function render() {
  drawStage(frame, hovered);
  drawEnergy();
  listContacts();
  $("slider").value = view.time[frame] ?? 0;
  $("now").textContent = view.time.length ? `t = ${view.time[frame].toFixed(4)} s` : "no frames";
}
function resize() {
  for (const canvas of [stage, energy]) {
    canvas.width = Math.round(canvas.clientWidth * (devicePixelRatio || 1));
    canvas.height = Math.round(canvas.clientHeight * (devicePixelRatio || 1));
  }
  if (fitted) fitCamera();
  render();
}
function goTo(k) {
  frame = Math.max(0, Math.min(view.time.length - 1, k));
  clock = view.time[frame] ?? 0;
  render();
}
// The last frame at or before a time: what is shown was computed, never interpolated.
function frameAt(t) {
  let low = 0, high = view.time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (view.time[middle] <= t + 1e-9 * (end - start)) low = middle; else high = middle - 1;
  }
  return low;
}
function setPlaying(wanted) {
  playing = wanted && view.time.length > 1;
  $("play").textContent = playing ? "❚❚ Pause" : "▶ Play";
  if (!playing) return;
  if (frame === view.time.length - 1) goTo(0);
  before = performance.now();
  requestAnimationFrame(tick);
}
function tick(now) {
  if (!playing) return;
  clock += Number($("speed").value) * (now - before) / 1000;
  before = now;
  if (clock >= end) { goTo(view.time.length - 1); setPlaying(false); return; }
  const k = frameAt(clock);
  if (k !== frame) { frame = k; render(); }
  requestAnimationFrame(tick);
}
function step(by) { setPlaying(false); goTo(frame + by); }

const at = (canvas, event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
let dragged = null;
function hover(event) {
  const p = at(stage, event), point = fromScreen(p);
  hovered = -1;
  view.bodies.forEach((body, i) => {
    const pose = view.time.length ? poseOf(frame, i) : null;
    if (pose && insideBody(body, pose, point)) hovered = hovered >= 0 && body.motion === "static" ? hovered : i;
  });
  const tip = $("tip");
  tip.style.display = hovered < 0 ? "none" : "block";
  if (hovered >= 0) {
    const pose = poseOf(frame, hovered);
    tip.textContent = `${bodyName(hovered)} (${view.bodies[hovered].motion})\nx ${pose[0].toPrecision(5)} m\ny ${
        pose[1].toPrecision(5)} m\nangle ${pose[2].toPrecision(5)} rad`;
    tip.style.left = Math.min(p[0] + 14, stage.clientWidth - 160) + "px";
    tip.style.top = Math.min(p[1] + 14, stage.clientHeight - 90) + "px";
  }
  render();
}
stage.addEventListener("pointerdown", (event) => { dragged = fromScreen(at(stage, event)); stage.setPointerCapture(event.pointerId); });
stage.addEventListener("pointerup", () => { dragged = null; });
stage.addEventListener("pointerleave", () => { hovered = -1; $("tip").style.display = "none"; render(); });
stage.addEventListener("pointermove", (event) => {
  if (dragged) {
    const p = fromScreen(at(stage, event));
    camera.x += dragged[0] - p[0]; camera.y += dragged[1] - p[1]; fitted = false;
  }
  hover(event);
});
stage.addEventListener("wheel", (event) => {
  if (part && !event.ctrlKey) return;
  event.preventDefault();
  const p = at(stage, event), old = fromScreen(p);
  camera.scale *= Math.exp(-0.0015 * event.deltaY);
  const moved = fromScreen(p);
  camera.x += old[0] - moved[0]; camera.y += old[1] - moved[1]; fitted = false;
  render();
}, {passive: false});
const zoom = (factor) => { camera.scale *= factor; fitted = false; render(); };
const fit = () => { fitted = true; fitCamera(); render(); };

const seek = (event) => {
  const map = energyMap();
  setPlaying(false);
  goTo(frameAt(start + map.span * (at(energy, event)[0] - margin.left) / map.w));
};
energy.addEventListener("pointerdown", (event) => { energy.setPointerCapture(event.pointerId); seek(event); });
energy.addEventListener("pointermove", (event) => { if (event.buttons & 1) seek(event); });

const actions = {play: () => setPlaying(!playing), back: () => step(-1), forward: () => step(1), first: () => step(-frame),
                 last: () => step(view.time.length), fit, zoom_in: () => zoom(1.25), zoom_out: () => zoom(0.8)};
for (const id of Object.keys(actions)) $(id).addEventListener("click", actions[id]);
$("slider").addEventListener("input", (event) => { setPlaying(false); goTo(frameAt(Number(event.target.value))); });
for (const name of Object.keys(show)) {
  $("show_" + name).addEventListener("change", (event) => { show[name] = event.target.checked; render(); });
}
const keys = {" ": "play", ArrowLeft: "back", ArrowRight: "forward", Home: "first", End: "last", f: "fit", "+": "zoom_in", "-": "zoom_out"};
document.addEventListener("keydown", (event) => {
  if (part && !part.contains(event.target)) return;
  if (!keys[event.key] || event.target.tagName === "SELECT" || event.ctrlKey || event.metaKey) return;
  if (event.target.tagName === "BUTTON" && event.key === " ") return;
  event.preventDefault();
  actions[keys[event.key]]();
});

Object.assign($("slider"), {min: start, max: end, step: "any"});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColours(); legend(); render(); });
const resized = new ResizeObserver(resize);
for (const canvas of [stage, energy]) resized.observe(canvas);
readColours();
legend();
magnifyResiduals();
$("marks").hidden = !marks.length;
if (marks.length) $("residual-scale").textContent = `Residuals are drawn ${residualFactor} times as long as they are.`;
// page.html#t=0.5 opens at that time.
const wanted = /[#&]t=([0-9.eE+-]+)/.exec(location.hash);
if (wanted) frame = frameAt(Number(wanted[1]));
clock = view.time[frame] ?? 0;
resize();
