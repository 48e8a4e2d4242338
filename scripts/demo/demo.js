// Plays a recorded drive: the hand with its landmarks, the signs, the robot in its world, and why it does what it does.
"use strict";
const DATA = JSON.parse(document.getElementById("data").textContent);
const at = (id) => document.getElementById(id);
const images = DATA.frames.map(({ image }) => Object.assign(new Image(), { src: `data:image/webp;base64,${image}` }));
let nowS = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, before = null;
let colours = {}, orbit = 0, lookAt = 0.5;

// The last of rows whose time is not later; rows are in the order of time.
function last(rows, time, timeOf = (row) => row.t) {
  let low = 0, high = rows.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (timeOf(rows[middle]) <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

function mix(a, b, part) { return a + (b - a) * part; }

function poseAt(time) {
  const n = last(DATA.reports, time), a = DATA.reports[n], b = DATA.reports[Math.min(n + 1, DATA.reports.length - 1)];
  const part = b.t > a.t ? Math.min(1, Math.max(0, (time - a.t) / (b.t - a.t))) : 0;
  const turn = Math.atan2(Math.sin(b.pose[2] - a.pose[2]), Math.cos(b.pose[2] - a.pose[2]));
  return [mix(a.pose[0], b.pose[0], part), mix(a.pose[1], b.pose[1], part), a.pose[2] + part * turn];
}

function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["text", "quiet", "grid", "accent", "go", "wait", "floor", "line", "card"]) {
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

// Returns a canvas's context, and its size in CSS pixels.
function sized(canvas) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  }
  const paint = canvas.getContext("2d");
  paint.setTransform(ratio, 0, 0, ratio, 0, 0);
  paint.clearRect(0, 0, width, height);
  return [paint, width, height];
}

function drawHand() {
  const n = last(DATA.frames, nowS), { hand } = DATA.frames[n];
  const [paint, width] = sized(at("picture")), scale = width / DATA.size[0];
  paint.scale(scale, scale);
  if (images[n].complete && images[n].naturalWidth) paint.drawImage(images[n], 0, 0, ...DATA.size);
  if (!hand.length) return;
  paint.lineWidth = 2;
  paint.strokeStyle = "#4ade80";
  paint.beginPath();
  for (const [a, b] of DATA.bones) {
    paint.moveTo(...hand[a]);
    paint.lineTo(...hand[b]);
  }
  paint.stroke();
  paint.fillStyle = "#ffffff";
  for (const [x, y] of hand) {
    paint.beginPath();
    paint.arc(x, y, 2.5, 0, 7);
    paint.fill();
  }
}

function makeBars() {
  for (const sign of DATA.signs) {
    const row = document.createElement("li");
    row.append(sign, document.createElement("div"));
    row.lastChild.append(document.createElement("i"));
    at("bars").append(row);
  }
  for (const [time, why] of DATA.stands) {
    const row = document.createElement("li");
    row.textContent = `at ${time.toFixed(1)} s: ${why}`;
    at("stands").append(row);
  }
}

function drawState() {
  const report = DATA.reports[last(DATA.reports, nowS)];
  at("does").textContent = report.does;
  at("does").parentElement.dataset.does = report.does;
  at("why").textContent = report.why;
  DATA.signs.forEach((sign, n) => {
    const row = at("bars").children[n];
    row.classList.toggle("counts", sign === report.sign);
    row.querySelector("i").style.width = `${100 * (report.bars[n] ?? 0)}%`;
  });
  at("time").value = nowS;
  at("now").textContent = `${nowS.toFixed(1)} of ${DATA.duration.toFixed(0)} s`;
}

// A box of a size around a centre, turned about the vertical, as its faces: corners in metres, and a colour.
function prism(corners, low, high, colour) {
  const faces = corners.map(([x, y], n) => {
    const [toX, toY] = corners[(n + 1) % corners.length];
    const light = 0.72 + 0.2 * Math.cos(Math.atan2(toY - y, toX - x) - 0.6);
    return { points: [[x, y, low], [toX, toY, low], [toX, toY, high], [x, y, high]], colour: shaded(colour, light) };
  });
  return [...faces, { points: corners.map(([x, y]) => [x, y, high]), colour: shaded(colour, 1) }];
}

function shaded([red, green, blue], light) {
  return `rgb(${red * light} ${green * light} ${blue * light})`;
}

function turned(x, y, yaw, corners) {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  return corners.map(([a, b]) => [x + c * a - s * b, y + s * a + c * b]);
}

function rectangle(length, width) {
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => [a * length / 2, b * width / 2]);
}

function round(diameter, corners = 14) {
  return Array.from({ length: corners }, (_, n) => [
    Math.cos(2 * Math.PI * n / corners) * diameter / 2, Math.sin(2 * Math.PI * n / corners) * diameter / 2]);
}

function thingFaces([kind, x, y, yaw, length, width, rgb]) {
  if (kind === "gate") return prism(turned(x, y, yaw, rectangle(length, width)), 0, 0.02, rgb);
  return prism(turned(x, y, yaw, kind === "box" ? rectangle(length, width) : round(length)), 0, 0.45, rgb);
}

// As large as the robot's model: 0.4 m long, with four wheels and a scanner.
function robotFaces([x, y, yaw]) {
  const part = (a, b, corners) => turned(x, y, yaw, corners.map(([p, q]) => [p + a, q + b]));
  const wheels = [[0.13, 0.22], [0.13, -0.22], [-0.13, 0.22], [-0.13, -0.22]];
  return [
    ...wheels.flatMap(([a, b]) => prism(part(a, b, rectangle(0.12, 0.04)), 0, 0.12, [40, 46, 60])),
    ...prism(part(0, 0, rectangle(0.4, 0.4)), 0.05, 0.15, [36, 87, 214]),
    ...prism(part(0.1, 0, round(0.09)), 0.15, 0.24, [250, 190, 40]),
  ];
}

function drawWorld() {
  const [paint, width, height] = sized(at("world")), pose = poseAt(nowS);
  const yaw = orbit, [x, y] = pose, far = 3.4;
  const eye = [x - far * Math.cos(yaw) * Math.cos(lookAt), y - far * Math.sin(yaw) * Math.cos(lookAt), 0.1 + far * Math.sin(lookAt)];
  const c = Math.cos(yaw), s = Math.sin(yaw), cp = Math.cos(lookAt), sp = Math.sin(lookAt), focal = 1.1 * Math.min(width, 1.4 * height);
  // Right, up and depth of a point, as seen from the eye.
  const seen = ([px, py, pz]) => {
    const dx = px - eye[0], dy = py - eye[1], dz = pz - eye[2], ahead = c * dx + s * dy;
    return [s * dx - c * dy, sp * ahead + cp * dz, cp * ahead - sp * dz];
  };
  const onScreen = ([right, up, depth]) => [width / 2 + focal * right / depth, height * 0.5 - focal * up / depth];
  const NEAR = 0.2;
  const line = (from, to) => {
    let a = seen(from), b = seen(to);
    if (a[2] < NEAR && b[2] < NEAR) return;
    if (a[2] < NEAR) [a, b] = [b, a];
    if (b[2] < NEAR) {
      const part = (a[2] - NEAR) / (a[2] - b[2]);
      b = a.map((value, n) => mix(value, b[n], part));
    }
    paint.moveTo(...onScreen(a));
    paint.lineTo(...onScreen(b));
  };
  paint.fillStyle = colours.floor;
  paint.fillRect(0, 0, width, height);
  paint.strokeStyle = colours.line;
  paint.lineWidth = 1;
  paint.beginPath();
  for (let n = -6; n <= 6; n++) {
    line([n, -6, 0], [n, 6, 0]);
    line([-6, n, 0], [6, n, 0]);
  }
  paint.stroke();
  paint.strokeStyle = colours.accent;
  paint.lineWidth = 3;
  paint.beginPath();
  const way = DATA.path.slice(0, last(DATA.path, nowS, (row) => row[0]) + 1).map(([, px, py]) => [px, py, 0.01]);
  for (let n = 1; n < way.length; n++) line(way[n - 1], way[n]);
  paint.stroke();
  const faces = [...DATA.things.flatMap(thingFaces), ...robotFaces(pose)].map(({ points, colour }) => {
    const corners = points.map(seen);
    return { corners, colour, depth: corners.reduce((sum, corner) => sum + Math.hypot(...corner), 0) / corners.length };
  });
  for (const { corners, colour } of faces.sort((one, other) => other.depth - one.depth)) {
    if (corners.some(([, , depth]) => depth < NEAR)) continue;
    paint.fillStyle = paint.strokeStyle = colour;
    paint.lineWidth = 0.7;
    paint.beginPath();
    corners.forEach((corner, n) => (n ? paint.lineTo(...onScreen(corner)) : paint.moveTo(...onScreen(corner))));
    paint.closePath();
    paint.fill();
    paint.stroke();
  }
  at("world").dataset.pose = pose.map((value) => value.toFixed(3)).join(" ");
}

function drawChart() {
  const [paint, width, height] = sized(at("chart")), toX = (time) => time / DATA.duration * width;
  const strip = 26, middle = (height + strip) / 2, room = (height - strip) / 2 - 4;
  paint.font = "12px system-ui, sans-serif";
  DATA.spans.forEach(([sign, begin, end]) => {
    paint.fillStyle = sign === "Stop" ? colours.quiet : colours.go;
    paint.fillRect(toX(begin), 0, Math.max(1, toX(end) - toX(begin) - 1), strip - 6);
    paint.fillStyle = colours.card;
    if (toX(end) - toX(begin) > 6.5 * sign.length) paint.fillText(sign, toX(begin) + 4, 14);
  });
  paint.strokeStyle = colours.grid;
  paint.lineWidth = 1;
  paint.beginPath();
  paint.moveTo(0, middle);
  paint.lineTo(width, middle);
  paint.stroke();
  const most = [1, 2].map((column) => Math.max(0.1, ...DATA.commanded.map((row) => Math.abs(row[column]))) * 1.1);
  for (const [rows, alpha] of [[DATA.commanded, 0.45], [DATA.driven, 1]]) {
    for (const [column, colour, thickness] of [[1, colours.accent, 2.5], [2, colours.wait, 1.2]]) {
      paint.globalAlpha = alpha;
      paint.strokeStyle = colour;
      paint.lineWidth = thickness;
      paint.beginPath();
      for (const row of rows) paint.lineTo(toX(row[0]), middle - room * row[column] / most[column - 1]);
      paint.stroke();
    }
  }
  paint.globalAlpha = 1;
  paint.fillStyle = colours.text;
  for (const [time] of DATA.stands) {
    paint.beginPath();
    paint.moveTo(toX(time), height - 9);
    paint.lineTo(toX(time) - 5, height);
    paint.lineTo(toX(time) + 5, height);
    paint.fill();
  }
  paint.fillRect(toX(nowS) - 1, 0, 2, height);
}

function draw() {
  drawHand();
  drawState();
  drawWorld();
  drawChart();
}

function go(time) {
  if (playing && before !== null) {
    nowS += (time - before) / 1000;
    if (nowS > DATA.duration) nowS = 0;
  }
  before = time;
  draw();
  requestAnimationFrame(go);
}

function setPlaying(on) {
  playing = on;
  at("play").textContent = on ? "Pause" : "Play";
}

at("time").max = DATA.duration;
at("time").addEventListener("input", (event) => {
  setPlaying(false);
  nowS = Number(event.target.value);
});
at("play").addEventListener("click", () => setPlaying(!playing));
at("world").addEventListener("pointermove", (event) => {
  if (!event.buttons) return;
  orbit -= event.movementX / 150;
  lookAt = Math.min(1.4, Math.max(0.15, lookAt + event.movementY / 200));
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);

readColours();
makeBars();
setPlaying(playing);
requestAnimationFrame(go);
