// Drawing of one frame. World: metres, y up; `camera` maps it to CSS pixels, y down.
"use strict";

const view = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const stage = $("stage"), context = stage.getContext("2d");
const camera = {x: 0, y: 0, scale: 100};
const show = {joints: true, contacts: true, names: false, marks: true};
let colours = {};

function readColours() {
  const style = getComputedStyle(document.documentElement);
  const get = (name) => style.getPropertyValue("--" + name).trim();
  colours = {panel: get("panel"), text: get("text"), muted: get("muted"), line: get("line"), grid: get("grid"),
             accent: get("accent"), series: Array.from({length: 8}, (_, i) => get("series-" + i))};
}

// Static bodies take no colour of the list, so that few bodies have well-told-apart ones.
let numMoving = 0;
for (const body of view.bodies) body.colour = body.motion === "static" ? -1 : numMoving++;

const bodyColour = (body) => body.colour < 0 ? colours.muted : colours.series[body.colour % 8];
function modeColour(mode) {
  if (mode.startsWith("stick")) return colours.series[2];
  if (mode.startsWith("slid")) return colours.series[1];
  return mode === "open" ? colours.muted : colours.series[0];
}

// Pose of body i in frame k as [x, y, angle]; null where it is not finite. Below 0: the world.
function poseOf(k, i) {
  if (i < 0 || i >= view.bodies.length) return [0, 0, 0];
  const body = view.bodies[i];
  const pose = body.pose || view.poses[k].slice(3 * body.colour, 3 * body.colour + 3);
  return pose.some((number) => number === null) ? null : pose;
}
function toWorld(pose, point) {
  const c = Math.cos(pose[2]), s = Math.sin(pose[2]);
  return [pose[0] + c * point[0] - s * point[1], pose[1] + s * point[0] + c * point[1]];
}
function toBody(pose, point) {
  const c = Math.cos(pose[2]), s = Math.sin(pose[2]), x = point[0] - pose[0], y = point[1] - pose[1];
  return [c * x + s * y, c * y - s * x];
}

// Vertices of the shape's core and the radius it is grown by; null for a half-plane and no shape.
function coreOf(body) {
  const n = body.numbers;
  switch (body.shape) {
    case "circle": return {points: [[0, 0]], radius: n[0]};
    case "ellipse": return {points: Array.from({length: 96}, (_, i) => [n[0] * Math.cos(i * Math.PI / 48),
                                                                        n[1] * Math.sin(i * Math.PI / 48)]), radius: 0};
    case "capsule": return {points: [[-n[0] / 2, 0], [n[0] / 2, 0]], radius: n[1]};
    case "box": return {points: [[-n[0] / 2, -n[1] / 2], [n[0] / 2, -n[1] / 2], [n[0] / 2, n[1] / 2],
                                 [-n[0] / 2, n[1] / 2]], radius: 0};
    case "polygon": return {points: Array.from({length: n.length / 2}, (_, i) => [n[2 * i], n[2 * i + 1]]), radius: 0};
    case "spline":  // points along the curve, so close to each other that it looks smooth
    case "polyline": return {points: Array.from({length: n.length / 2}, (_, i) => [n[2 * i], n[2 * i + 1]]), radius: 0};
    default: return null;
  }
}
for (const body of view.bodies) body.core = coreOf(body);
const reach = (core) => core.radius + Math.max(...core.points.map((p) => Math.hypot(p[0], p[1])));

function insideBody(body, pose, point) {
  const p = toBody(pose, point);
  if (body.shape === "half_plane") return body.numbers[0] * p[0] + body.numbers[1] * p[1] <= body.numbers[2];
  if (!body.core) return Math.hypot(p[0], p[1]) * camera.scale < 9;
  if (body.shape === "polyline" || body.shape === "spline") return false;
  const {points, radius} = body.core;
  if (points.length > 2) {
    // A ray towards +x crosses the outline an odd number of times.
    return points.reduce((inside, a, i) => {
      const b = points[(i + 1) % points.length];
      if ((a[1] > p[1]) === (b[1] > p[1])) return inside;
      return p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) ? !inside : inside;
    }, false);
  }
  const a = points[0], d = points.length === 2 ? [points[1][0] - a[0], points[1][1] - a[1]] : [0, 0];
  const length2 = d[0] * d[0] + d[1] * d[1];
  const t = length2 > 0 ? Math.min(1, Math.max(0, ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / length2)) : 0;
  return Math.hypot(p[0] - a[0] - t * d[0], p[1] - a[1] - t * d[1]) <= radius;
}

// What the motion covers: [x low, y low, x high, y high]. Static bodies widen it by at most half its
// size, so that a long floor does not shrink the motion to a dot.
function motionBounds() {
  const empty = () => [Infinity, Infinity, -Infinity, -Infinity];
  const add = (box, x, y, r) => {
    box[0] = Math.min(box[0], x - r); box[1] = Math.min(box[1], y - r);
    box[2] = Math.max(box[2], x + r); box[3] = Math.max(box[3], y + r);
  };
  let box = empty();
  const still = empty(), stride = Math.max(1, Math.floor(view.time.length / 400));
  view.bodies.forEach((body, i) => {
    if (body.shape === "half_plane") return;
    const r = body.core ? reach(body.core) : 0;
    for (let k = 0; k < view.time.length; k += body.pose ? view.time.length : stride) {
      const pose = poseOf(k, i);
      if (pose) add(body.pose ? still : box, pose[0], pose[1], r);
    }
  });
  for (const link of [...view.joints, ...view.springs]) {
    link.bodies.forEach((body, j) => { if (body < 0 && link.anchors[j]) add(box, ...link.anchors[j], 0); });
  }
  for (const frame of view.marks || []) {
    for (let i = 0; i < frame.length; i += 4) {
      if (frame[i] !== null && frame[i + 1] !== null) add(box, frame[i], frame[i + 1], 0);
    }
  }
  if (!(box[0] <= box[2])) box = still[0] <= still[2] ? still : [-1, -1, 1, 1];
  const room = 0.5 * Math.max(box[2] - box[0], box[3] - box[1]);
  if (still[0] <= still[2]) {
    box = [Math.min(box[0], Math.max(still[0], box[0] - room)), Math.min(box[1], Math.max(still[1], box[1] - room)),
           Math.max(box[2], Math.min(still[2], box[2] + room)), Math.max(box[3], Math.min(still[3], box[3] + room))];
  }
  return box;
}
function fitCamera() {
  const box = motionBounds(), w = stage.clientWidth - 90, h = stage.clientHeight - 70;
  const wide = Math.max(box[2] - box[0], 1e-9), high = Math.max(box[3] - box[1], 1e-9);
  camera.scale = Math.max(1e-12, Math.min(w / wide, h / high));
  camera.x = (box[0] + box[2]) / 2; camera.y = (box[1] + box[3]) / 2;
}
const toScreen = (p) => [stage.clientWidth / 2 + 16 + (p[0] - camera.x) * camera.scale,
                         stage.clientHeight / 2 - 8 - (p[1] - camera.y) * camera.scale];
const fromScreen = (p) => [camera.x + (p[0] - stage.clientWidth / 2 - 16) / camera.scale,
                           camera.y - (p[1] - stage.clientHeight / 2 + 8) / camera.scale];

// The tick step 1, 2 or 5 times a power of ten that gives about `count` ticks over `span`.
function tickStep(span, count) {
  const raw = span / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  return power * (raw / power < 1.5 ? 1 : raw / power < 3.5 ? 2 : raw / power < 7.5 ? 5 : 10);
}
const tickText = (value, step) => {
  if (Math.abs(value) < 1e-9 * step) return "0";
  return Math.abs(value) >= 1e5 || step < 1e-4 ? value.toExponential(1)
                                               : value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
};

function hatch(g, colour) {
  const tile = document.createElement("canvas"), ratio = devicePixelRatio || 1;
  tile.width = tile.height = Math.round(9 * ratio);
  const t = tile.getContext("2d"), n = tile.width;
  t.strokeStyle = colour; t.lineWidth = ratio; t.globalAlpha = 0.55;
  t.beginPath();
  for (const shift of [-n, 0, n]) { t.moveTo(shift - 2, n + 2); t.lineTo(shift + n + 2, -2); }
  t.stroke();
  const pattern = g.createPattern(tile, "repeat");
  pattern.setTransform(new DOMMatrix().scale(1 / ratio));
  return pattern;
}

function line(g, a, b) { g.beginPath(); g.moveTo(a[0], a[1]); g.lineTo(b[0], b[1]); g.stroke(); }
function disc(g, p, r) { g.beginPath(); g.arc(p[0], p[1], r, 0, 2 * Math.PI); }
function arrow(g, a, b) {
  const d = Math.hypot(b[0] - a[0], b[1] - a[1]);
  if (d < 1) return;
  const u = [(b[0] - a[0]) / d, (b[1] - a[1]) / d], h = Math.min(9, 0.6 * d);
  line(g, a, [b[0] - 0.7 * h * u[0], b[1] - 0.7 * h * u[1]]);
  g.beginPath(); g.moveTo(b[0], b[1]);
  g.lineTo(b[0] - h * u[0] + 0.45 * h * u[1], b[1] - h * u[1] - 0.45 * h * u[0]);
  g.lineTo(b[0] - h * u[0] - 0.45 * h * u[1], b[1] - h * u[1] + 0.45 * h * u[0]);
  g.closePath(); g.fill();
}

// Calls `each` with the value and the pixel of every grid line of an axis (0: x, 1: y).
function eachTick(axis, each) {
  const step = tickStep(90 / camera.scale, 1);
  const low = fromScreen([0, stage.clientHeight])[axis], high = fromScreen([stage.clientWidth, 0])[axis];
  for (let i = Math.ceil(low / step); i * step <= high; i++) {
    each(tickText(i * step, step), toScreen([i * step, i * step])[axis]);
  }
}
function drawGrid(g) {
  g.lineWidth = 1; g.strokeStyle = colours.grid;
  eachTick(0, (_, x) => line(g, [x, 0], [x, stage.clientHeight]));
  eachTick(1, (_, y) => line(g, [0, y], [stage.clientWidth, y]));
}
function drawText(g, text, x, y, colour) {
  g.lineWidth = 4; g.lineJoin = "round"; g.strokeStyle = colours.panel; g.strokeText(text, x, y);
  g.fillStyle = colour; g.fillText(text, x, y);
}
// Over the bodies, with a halo, so that they read on a hatched floor too.
function drawTickLabels(g) {
  const w = stage.clientWidth, h = stage.clientHeight;
  g.font = "11px system-ui, sans-serif"; g.textBaseline = "middle";
  g.textAlign = "center";
  eachTick(0, (text, x) => { if (x > 46 && x < w - 50) drawText(g, text, x, h - 10, colours.muted); });
  g.textAlign = "left";
  eachTick(1, (text, y) => { if (y > 26 && y < h - 26) drawText(g, text, 6, y, colours.muted); });
  drawText(g, "y (m)", 6, 12, colours.muted);
  g.textAlign = "right"; drawText(g, "x (m)", w - 6, h - 10, colours.muted);
}

function traceCore(g, pose, core) {
  const p = core.points.map((point) => toScreen(toWorld(pose, point))), r = core.radius * camera.scale, a = -pose[2];
  g.beginPath();
  if (p.length === 1) {
    g.arc(p[0][0], p[0][1], r, 0, 2 * Math.PI);
  } else if (p.length === 2) {
    g.arc(p[1][0], p[1][1], r, a - Math.PI / 2, a + Math.PI / 2);
    g.arc(p[0][0], p[0][1], r, a + Math.PI / 2, a + 1.5 * Math.PI);
  } else {
    p.forEach((point) => g.lineTo(point[0], point[1]));
  }
  g.closePath();
}
function drawHalfPlane(g, body, pose) {
  const [nx, ny, offset] = body.numbers, norm = Math.hypot(nx, ny);
  if (!(norm > 0)) return;
  const c = Math.cos(pose[2]), s = Math.sin(pose[2]);
  const n = [(c * nx - s * ny) / norm, (s * nx + c * ny) / norm];
  const d = offset / norm + n[0] * (pose[0] - camera.x) + n[1] * (pose[1] - camera.y);
  const far = 2 * (stage.clientWidth + stage.clientHeight) / camera.scale;
  const at = (along, below) => toScreen([camera.x + d * n[0] + along * n[1] - below * n[0],
                                         camera.y + d * n[1] - along * n[0] - below * n[1]]);
  g.beginPath();
  for (const p of [at(-far, 0), at(far, 0), at(far, far), at(-far, far)]) g.lineTo(p[0], p[1]);
  g.closePath();
  g.fillStyle = hatch(g, colours.muted); g.fill();
  g.strokeStyle = colours.text; g.lineWidth = 1.5; line(g, at(-far, 0), at(far, 0));
}
function drawContactPoints(g, body, pose) {
  g.fillStyle = bodyColour(body);
  for (const point of body.points || []) { disc(g, toScreen(toWorld(pose, point)), 3); g.fill(); }
}
// Where a body stands on the plane of motion: a cross at each point, or the outline of a disc.
function drawSupport(g, body, pose) {
  g.strokeStyle = bodyColour(body); g.lineWidth = 1.2;
  for (const point of body.support || []) {
    const [x, y] = toScreen(toWorld(pose, point));
    line(g, [x - 4, y - 4], [x + 4, y + 4]); line(g, [x - 4, y + 4], [x + 4, y - 4]);
  }
  if (!body.support_radius) return;
  g.setLineDash([2, 3]);
  disc(g, toScreen([pose[0], pose[1]]), body.support_radius * camera.scale); g.stroke();
  g.setLineDash([]);
}
// The line, with strokes of equal distance on the side of the solid.
function drawPolyline(g, body, pose) {
  const points = body.core.points.map((p) => toScreen(toWorld(pose, p)));
  if (body.closed) points.push(points[0]);
  g.strokeStyle = bodyColour(body); g.lineWidth = 1.5; g.beginPath();
  for (const p of points) g.lineTo(p[0], p[1]);
  g.stroke();
  g.lineWidth = 1;
  let left = 4;
  for (let i = 1; i < points.length; i++) {
    const a = points[i - 1], b = points[i], length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    const t = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    for (; left < length && length < 1e5; left += 8) {
      const p = [a[0] + left * t[0], a[1] + left * t[1]];
      // Screens have y downwards, so that left of the way is (t_y, -t_x).
      line(g, p, [p[0] + 6 * (body.solid * t[1] - t[0]), p[1] - 6 * (body.solid * t[0] + t[1])]);
    }
    left = Math.max(left - length, 0);
  }
}
function drawBody(g, body, pose, hovered) {
  if (body.shape === "half_plane") { drawHalfPlane(g, body, pose); return; }
  if (body.shape === "polyline" || body.shape === "spline") { drawPolyline(g, body, pose); return; }
  const colour = bodyColour(body), centre = toScreen([pose[0], pose[1]]);
  g.strokeStyle = colour; g.lineWidth = hovered ? 3 : 1.5;
  if (!body.core) {
    disc(g, centre, 4); g.stroke();
    line(g, centre, toScreen(toWorld(pose, [10 / camera.scale, 0])));
    return;
  }
  traceCore(g, pose, body.core);
  if (body.motion === "static") {
    g.fillStyle = hatch(g, colour); g.fill(); g.stroke();
    return;
  }
  g.globalAlpha = hovered ? 0.4 : 0.22; g.fillStyle = colour; g.fill(); g.globalAlpha = 1;
  if (body.motion === "kinematic") g.setLineDash([6, 4]);
  g.stroke(); g.setLineDash([]);
  // The mark runs from the centre along the body's x axis to its outline.
  const mark = body.shape === "circle" ? body.core.radius : body.shape === "ellipse" ? body.numbers[0]
      : body.core.radius + 0.5 * Math.max(...body.core.points.map((p) => p[0]));
  g.lineWidth = 1.5; line(g, centre, toScreen(toWorld(pose, [mark, 0])));
  g.fillStyle = colour; disc(g, centre, 2.2); g.fill();
}

function linkEnds(link, k) {
  const poses = link.bodies.map((body) => poseOf(k, body));
  return poses[0] && poses[1] ? {poses, points: poses.map((pose, j) => toScreen(toWorld(pose, link.anchors[j])))} : null;
}
function drawGround(g, p) {
  g.beginPath(); g.moveTo(p[0], p[1]); g.lineTo(p[0] - 8, p[1] - 12); g.lineTo(p[0] + 8, p[1] - 12); g.closePath(); g.stroke();
  for (let x = -8; x <= 4; x += 4) line(g, [p[0] + x, p[1] - 12], [p[0] + x + 4, p[1] - 17]);
}
// A ring that is open at the top, with an arrow's head at each end.
function drawServo(g, p) {
  g.beginPath(); g.arc(p[0], p[1], 9, -0.25 * Math.PI, 1.25 * Math.PI); g.stroke();
  for (const side of [-1, 1]) {
    const x = p[0] + side * 6.4, y = p[1] - 6.4;
    g.beginPath(); g.moveTo(x - side * 3.6, y - 3.6); g.lineTo(x + side * 2.8, y - 2.4); g.lineTo(x - side * 2, y + 2.8);
    g.closePath(); g.fillStyle = g.strokeStyle; g.fill();
  }
}
function drawJoint(g, joint, k) {
  if (view.time[k] >= joint.until) return;
  const ends = linkEnds(joint, k);
  if (!ends) return;
  const [a, b] = ends.points;
  g.strokeStyle = g.fillStyle = colours.text; g.lineWidth = 1.4;
  if (joint.type === "revolute") {
    if (joint.bodies.some((body) => body < 0)) drawGround(g, a);
    disc(g, a, 3.6); g.fillStyle = colours.panel; g.fill(); g.stroke();
    if (joint.motor) { disc(g, a, 7); g.stroke(); }
    if (joint.servo) drawServo(g, a);
  } else if (joint.type === "weld") {
    g.fillRect(a[0] - 4, a[1] - 4, 8, 8);
  } else if (joint.type === "distance") {
    line(g, a, b);
    for (const p of [a, b]) { disc(g, p, 3); g.fill(); }
  } else if (joint.type === "rope") {
    // A slack rope hangs below the line between its ends by about what its length leaves.
    const d = Math.hypot(b[0] - a[0], b[1] - a[1]), length = (joint.rope || 0) * camera.scale;
    const sag = length > d ? 0.85 * Math.sqrt(length * length - d * d) : 0;
    g.beginPath(); g.moveTo(a[0], a[1]);
    g.quadraticCurveTo((a[0] + b[0]) / 2, (a[1] + b[1]) / 2 + sag, b[0], b[1]); g.stroke();
    for (const p of [a, b]) { disc(g, p, 2.2); g.fill(); }
  } else if (joint.type === "prismatic") {
    const c = Math.cos(ends.poses[1][2]), s = Math.sin(ends.poses[1][2]);
    const u = [c * joint.axis[0] - s * joint.axis[1], -(s * joint.axis[0] + c * joint.axis[1])];
    g.setLineDash([7, 4]); line(g, [b[0] - 2000 * u[0], b[1] - 2000 * u[1]], [b[0] + 2000 * u[0], b[1] + 2000 * u[1]]);
    g.setLineDash([]); g.strokeRect(a[0] - 5, a[1] - 5, 10, 10);
    if (joint.motor) { disc(g, a, 7); g.stroke(); }
    if (joint.servo) drawServo(g, a);
  } else {
    g.setLineDash([2, 4]);
    line(g, ...ends.poses.map((pose, j) => toScreen(joint.bodies[j] < 0 ? toWorld(ends.poses[1 - j], [0, 0]) : pose)));
    g.setLineDash([]);
  }
}
function drawSpring(g, spring, k) {
  const ends = linkEnds(spring, k);
  if (!ends) return;
  const [a, b] = ends.points, d = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const u = d > 0 ? [(b[0] - a[0]) / d, (b[1] - a[1]) / d] : [0, 0];
  g.strokeStyle = colours.series[5]; g.lineWidth = 1.6; g.lineJoin = "round";
  g.beginPath(); g.moveTo(a[0], a[1]);
  for (let i = 0; i <= 16; i++) {
    const t = d * (0.1 + 0.8 * i / 16), side = i === 0 || i === 16 ? 0 : i % 2 ? 6 : -6;
    g.lineTo(a[0] + t * u[0] - side * u[1], a[1] + t * u[1] + side * u[0]);
  }
  g.lineTo(b[0], b[1]); g.stroke();
}

// Lengths of arrows: square root, so that an impact of 100 times a weight's impulse hides neither.
let impulseMax = 0;
for (const frame of view.contacts) for (const c of frame) impulseMax = Math.max(impulseMax, Math.hypot(c[6], c[7]));
const arrowLength = (impulse) => impulseMax > 0 ? 80 * Math.sqrt(impulse / impulseMax) : 0;

function drawContact(g, c) {
  if (c.some((number) => number === null)) return;
  const p = toScreen([c[2], c[3]]), normal = [c[4], -c[5]], tangent = [c[5], c[4]];
  g.lineWidth = 2.2;
  const part = (direction, impulse, colour) => {
    const length = Math.sign(impulse) * arrowLength(Math.abs(impulse));
    g.strokeStyle = g.fillStyle = colour;
    arrow(g, p, [p[0] + length * direction[0], p[1] + length * direction[1]]);
  };
  part(normal, c[6], colours.series[4]);
  part(tangent, c[7], colours.series[3]);
  g.fillStyle = modeColour(view.modes[c[8]]); g.strokeStyle = colours.panel; g.lineWidth = 1.2;
  disc(g, p, 4.2); g.fill(); g.stroke();
}

// Residuals are small beside the motion: the longest arrow is about an eighth of what is shown.
const marks = view.marks || [];
const finite = (numbers) => numbers.every((number) => number !== null);
let residualFactor = 1;
function magnifyResiduals() {
  let longest = 0;
  for (const frame of marks) {
    for (let i = 0; i < frame.length; i += 4) {
      const m = frame.slice(i, i + 4);
      if (finite(m)) longest = Math.max(longest, Math.hypot(m[2] - m[0], m[3] - m[1]));
    }
  }
  const box = motionBounds(), extent = Math.max(box[2] - box[0], box[3] - box[1]);
  if (!(longest > 0) || !(extent > 0)) return;
  const wanted = 0.125 * extent / longest, power = Math.pow(10, Math.floor(Math.log10(wanted)));
  residualFactor = Math.max(1, power * (wanted / power >= 5 ? 5 : wanted / power >= 2 ? 2 : 1));
}
function drawMarks(g, k) {
  const all = marks[k] || [];
  for (let i = 0; i < all.length; i += 4) {
    const m = all.slice(i, i + 4);
    if (!finite(m)) continue;
    const p = toScreen([m[0], m[1]]), long = residualFactor * camera.scale;
    g.strokeStyle = colours.text; g.lineWidth = 1.6;
    line(g, [p[0] - 5, p[1]], [p[0] + 5, p[1]]); line(g, [p[0], p[1] - 5], [p[0], p[1] + 5]);
    g.strokeStyle = g.fillStyle = colours.series[4]; g.lineWidth = 2;
    arrow(g, p, [p[0] + long * (m[2] - m[0]), p[1] - long * (m[3] - m[1])]);
  }
}

function drawStage(k, hovered) {
  const g = context, ratio = devicePixelRatio || 1;
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, stage.clientWidth, stage.clientHeight);
  drawGrid(g);
  if (!view.time.length) return;
  const poses = view.bodies.map((_, i) => poseOf(k, i));
  view.bodies.forEach((body, i) => { if (poses[i] && body.motion === "static") drawBody(g, body, poses[i], i === hovered); });
  view.bodies.forEach((body, i) => { if (poses[i] && body.motion !== "static") drawBody(g, body, poses[i], i === hovered); });
  view.bodies.forEach((body, i) => {
    if (poses[i]) { drawContactPoints(g, body, poses[i]); drawSupport(g, body, poses[i]); }
  });
  if (show.joints) {
    for (const spring of view.springs) drawSpring(g, spring, k);
    for (const joint of view.joints) drawJoint(g, joint, k);
  }
  if (show.contacts) for (const contact of view.contacts[k]) drawContact(g, contact);
  if (show.marks) drawMarks(g, k);
  drawTickLabels(g);
  if (!show.names) return;
  g.font = "12px system-ui, sans-serif"; g.textAlign = "left"; g.textBaseline = "middle";
  view.bodies.forEach((body, i) => {
    if (!poses[i] || body.shape === "half_plane") return;
    const p = toScreen(poses[i]);
    drawText(g, body.name, p[0] + 7, p[1] - 9, colours.text);
  });
}
