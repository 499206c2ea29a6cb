"use strict";
// The data is in blocks of JSON. Text of the data set is set as text, never as markup.
const get = (id) => document.getElementById(id);
const read = (id) => JSON.parse(get(id).textContent);
const data = read("summary");
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const rgb = (c) => `rgb(${c.join(" ")})`;
const dot = (colour) => {
  const element = make("i", { className: "dot" });
  element.style.background = colour;
  return element;
};
const choose = (select, names) => {
  const before = select.value;
  select.replaceChildren(...names.map((n) => make("option", { value: n, textContent: n })));
  if (names.includes(before)) select.value = before;
  select.hidden = names.length === 0;
};
const hue = (i) => `hsl(${(137.508 * i) % 360} 62% ${i % 2 ? 46 : 58}%)`;
const count = (n) => n.toLocaleString("en");
// A number that is not finite is null in JSON.
const fixed = (v, digits) => (Number.isFinite(v) ? v.toFixed(digits) : "–");
const percent = (v) => `${fixed(100 * v, v < 0.1 ? 2 : 1)} %`;
const svg = (tag, attributes, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  Object.entries(attributes).forEach(([k, v]) => element.setAttribute(k, v));
  if (text !== undefined) element.textContent = text;
  return element;
};
// A section whose data cannot be drawn says so, and takes no other along.
const attempt = (section, draw) => {
  try {
    draw();
  } catch (error) {
    const id = `${section}-note`;
    const note = get(id) ?? make("p", { id, className: "hint" });
    note.textContent = `Not all of this can be shown: ${error.message}`;
    get(section).append(note);
  }
};

// Head.
const many = (n) => (n < 1e6 ? count(n) : `${fixed(n / 1e6, 1)} million`);
const pixels = data.classes.reduce((sum, c) => sum + c.pixels, 0);
const points = data.classes.reduce((sum, c) => sum + c.points, 0);
attempt("head", () => {
  document.title = get("name").textContent = data.name;
  get("facts").textContent = [
    `${count(data.frames_total)} frames in ${data.sequences.length} sequence${data.sequences.length === 1 ? "" : "s"}`,
    pixels && `${many(pixels)} pixels`,
    points && `${many(points)} points`,
    data.trees_total && `${count(data.trees_total)} trees`,
    `${fixed(data.bytes / 1e6, 0)} MB`,
  ].filter(Boolean).join(" · ");
  get("warnings").append(...data.warnings.map((w) => make("li", { textContent: w })));
});

// Frames.
const wholes = data.frames.map((f, i) => [f.whole, i]).filter(([w]) => w !== null);
const nearest = (i) => wholes.reduce((best, w) =>
  Math.abs(w[1] - i) < Math.abs(best[1] - i) ? w : best);
let current = -1;
let whole = null;
let pixelsOf = {};

let film = [];
const frameButton = (frame, i) => {
  if (frame.thumbnail === null && frame.whole === null) return null;
  const name = `sequence ${frame.sequence}, frame ${frame.index}`;
  const picture = frame.thumbnail
    ? make("img", { src: frame.thumbnail, alt: name, loading: "lazy" })
    : make("span", { textContent: `${frame.sequence}/${frame.index}` });
  const button = make("button", { type: "button", title: name, onclick: () => show(i) }, picture);
  if (frame.whole !== null) button.dataset.whole = "";
  get("film").append(button);
  return button;
};
attempt("frames", () => {
  const total = count(data.frames_total);
  get("whole").textContent = wholes.length === 0 ? "No frame is shown in full."
    : wholes.length < data.frames_total
    ? `${wholes.length} of ${total} frames are shown in full, with a line below: they have all their maps here, and of the others the nearest such frame is shown.`
    : "All frames are shown in full.";
  for (const id of wholes.length ? [] : ["viewer", "slide", "scan"]) get(id).hidden = true;
  film = data.frames.map(frameButton);
});

function show(asked) {
  if (wholes.length === 0) return;
  const [block, i] = nearest(Math.max(0, Math.min(data.frames.length - 1, asked)));
  if (i === current) return;
  film[current]?.removeAttribute("aria-current");
  current = i;
  film[i].setAttribute("aria-current", "true");
  const strip = get("film");
  strip.scrollLeft = film[i].offsetLeft - strip.offsetLeft - strip.clientWidth / 2;
  whole = read(`frame-${block}`);
  const frame = data.frames[i];
  get("which").textContent = `sequence ${frame.sequence}, frame ${frame.index}, ${fixed(frame.time_s, 1)} s`;
  choose(get("camera"), whole.views.map((v) => v.name));
  choose(get("lidar"), whole.scans.map((s) => s.name));
  get("viewer").hidden = get("slide").hidden = whole.views.length === 0;
  for (const id of ["frames", "scan"]) get(`${id}-note`)?.remove();
  attempt("frames", showView);
  attempt("scan", showScan);
  if (frame.sequence !== Number(get("world").value)) {
    get("world").value = frame.sequence;
    attempt("map", fitMap);
  }
  attempt("map", drawMap);
}

const theView = () => whole.views.find((v) => v.name === get("camera").value);

function showView() {
  const view = theView();
  if (!view) return;
  const names = view.maps.map((m) => m.name);
  const isFirst = get("left").value === "";
  choose(get("left"), names);
  choose(get("right"), names);
  if (isFirst) get("right").value = "Classes";
  const source = (id) => view.maps.find((m) => m.name === get(id).value).src;
  get("over").src = source("left");
  get("under").src = source("right");
  get("boxes").parentElement.hidden = view.boxes.length === 0;
  const boxes = get("boxes").checked ? view.boxes : [];
  get("outlines").replaceChildren(...boxes.map(([x, y, width, height, kind]) => {
    const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    Object.entries({ x, y, width, height }).forEach(([k, v]) => rect.setAttribute(k, v));
    const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
    title.textContent = kind;
    rect.append(title);
    return rect;
  }));
  pixelsOf = {};
  for (const map of view.maps.filter((m) => m.name === "Classes" || m.name === "Depth")) {
    const image = new Image();
    image.onload = () => {
      const canvas = make("canvas", { width: view.width, height: view.height });
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.drawImage(image, 0, 0);
      pixelsOf[map.name] = context.getImageData(0, 0, view.width, view.height);
    };
    image.src = map.src;
  }
}

function slide() {
  const share = get("slide").value / 10;
  get("over").style.clipPath = `inset(0 ${100 - share}% 0 0)`;
  get("split").style.left = `calc(${share}% - 1px)`;
}

const colours = new Map(data.classes.map((c) => [c.colour.join(), c.name]));
const depths = new Map(data.depth.palette.map((c, i) => [c.join(), i]));
get("viewer").addEventListener("pointermove", (event) => {
  const box = get("viewer").getBoundingClientRect();
  const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  if (event.buttons) {
    get("slide").value = 1000 * x;
    slide();
  }
  const colour = (name) => {
    const image = pixelsOf[name];
    if (!image) return "";
    const at = 4 * (Math.floor(y * image.height) * image.width + Math.floor(x * image.width));
    return Array.from(image.data.slice(at, at + 3)).join();
  };
  const index = depths.get(colour("Depth"));
  const metres = index ? ` · ${(data.depth.far_m ** ((index - 1) / 254)).toPrecision(3)} m` : "";
  get("pixel").textContent = (colours.get(colour("Classes")) ?? "") + metres;
});
get("viewer").addEventListener("pointerleave", () => { get("pixel").textContent = ""; });
get("viewer").addEventListener("pointerdown", (event) => {
  const box = get("viewer").getBoundingClientRect();
  get("slide").value = 1000 * (event.clientX - box.left) / box.width;
  slide();
});
get("slide").addEventListener("input", slide);
for (const id of ["camera", "left", "right", "boxes"]) get(id).addEventListener("change", showView);
const move = (by) => {
  const at = wholes.findIndex(([, i]) => i === current) + by;
  if (wholes[at]) show(wholes[at][1]);
};
get("before").onclick = () => move(-1);
get("after").onclick = () => move(1);
addEventListener("keydown", (event) => {
  if (/^(INPUT|SELECT|CANVAS)$/.test(event.target.tagName)) return;
  if (event.key === "ArrowLeft") move(-1);
  if (event.key === "ArrowRight") move(1);
});

// Scan.
let renderer = null;
let scene, camera, controls, cloud, scan;
const hidden = new Set();
try {
  renderer = new THREE.WebGLRenderer({ canvas: get("cloud"), antialias: true });
  renderer.setClearColor(0x14181a);
  scene = new THREE.Scene();
  camera = new THREE.PerspectiveCamera(50, 1, 0.1, 2000);
  camera.up.set(0, 0, 1);
  controls = new THREE.OrbitControls(camera, get("cloud"));
  controls.listenToKeyEvents(get("cloud"));
  controls.addEventListener("change", drawScan);
  look([-13, -4, 7], [12, 0, 0]);
} catch {
  get("cloud").hidden = true;
  get("points").textContent = "This browser has no WebGL, so that scans cannot be drawn.";
}

function look(from, at) {
  controls.target.set(...at);
  camera.position.set(...from);
  controls.update();
}

function unpack(packed) {
  const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
  const n = packed.count;
  const axis = (k) => new Int16Array(bytes.buffer, 2 * n * k, n);
  const [x, y, z] = [axis(0), axis(1), axis(2)];
  const position = new Float32Array(3 * n);
  for (let i = 0; i < n; i++) {
    position.set([x[i] * packed.unit_m, y[i] * packed.unit_m, z[i] * packed.unit_m], 3 * i);
  }
  return {
    ...packed, position,
    instance: new Uint16Array(bytes.buffer, 6 * n, n),
    time: new Uint16Array(bytes.buffer, 8 * n, n),
    class: new Uint8Array(bytes.buffer, 10 * n, n),
    intensity: new Uint8Array(bytes.buffer, 11 * n, n),
  };
}

function showScan() {
  const packed = whole.scans.find((s) => s.name === get("lidar").value);
  get("scan").hidden = !packed;
  if (!packed) return;
  scan = unpack(packed);
  const thinned = scan.count < scan.total ? `, ${count(scan.count)} of them here` : "";
  if (renderer) get("points").textContent = `${count(scan.total)} points${thinned}`;
  get("colour").querySelector("[value=time]").disabled = !scan.timed;
  const present = new Set(scan.class);
  get("legend").replaceChildren(...data.classes.filter((c) => present.has(c.id)).map((c) => {
    const button = make("button", { type: "button" }, dot(rgb(c.colour)), c.name);
    button.setAttribute("aria-pressed", String(!hidden.has(c.id)));
    button.onclick = () => {
      if (!hidden.delete(c.id)) hidden.add(c.id);
      button.setAttribute("aria-pressed", String(!hidden.has(c.id)));
      colourScan();
    };
    return button;
  }));
  colourScan();
  showRanges();
}

// How many points there are at which range, by class.
function showRanges() {
  const range = (i) => Math.hypot(...scan.position.subarray(3 * i, 3 * i + 3));
  const ranges = Array.from({ length: scan.count }, (_, i) => range(i));
  const sorted = [...ranges].sort((a, b) => a - b);
  get("ranges").replaceChildren();
  if (scan.count === 0) return;
  const far = sorted[Math.floor(0.98 * (scan.count - 1))];
  plot("Ranges of the scan's points", [far], "range, m", (root, x, top) => {
    const bins = Array.from({ length: 60 }, () => new Map());
    ranges.forEach((r, i) => {
      const bin = bins[Math.min(59, Math.floor(60 * r / top))];
      bin.set(scan.class[i], (bin.get(scan.class[i]) ?? 0) + 1);
    });
    const most = Math.max(...bins.map((b) => [...b.values()].reduce((a, n) => a + n, 0)));
    bins.forEach((bin, i) => {
      let y = 190;
      for (const c of data.classes.filter((c) => bin.has(c.id))) {
        const height = 170 * bin.get(c.id) / most;
        y -= height;
        root.append(svg("rect", { x: x(i * top / 60), y, height, width: x(top / 60) - x(0) - 0.5, fill: rgb(c.colour) }));
      }
    });
    root.append(svg("text", { x: 2, y: 14 }, `${percent(most / scan.count)} of the points`));
  }, get("ranges"));
}

// From dark blue over green to yellow: viridis, by three of its colours.
const ramp = (t) => {
  const stops = [[0.27, 0.05, 0.4], [0.13, 0.57, 0.55], [0.99, 0.91, 0.15]];
  const u = 2 * Math.max(0, Math.min(0.9999, t));
  const [a, b] = [stops[Math.floor(u)], stops[Math.floor(u) + 1]];
  return a.map((v, k) => v + (b[k] - v) * (u % 1));
};

function colourScan() {
  if (!renderer) return;
  const n = scan.count;
  const [by, kept, colour] = [get("colour").value, [], []];
  const height = (i) => scan.position[3 * i + 2];
  const sorted = Array.from({ length: n }, (_, i) => height(i)).sort((a, b) => a - b);
  const [low, high] = [sorted[Math.floor(0.02 * n)], sorted[Math.floor(0.98 * n)]];
  const classes = new Map(data.classes.map((c) => [c.id, c.colour.map((v) => v / 255)]));
  const tint = new THREE.Color();
  for (let i = 0; i < n; i++) {
    if (hidden.has(scan.class[i])) continue;
    kept.push(scan.position[3 * i], scan.position[3 * i + 1], height(i));
    if (by === "class") colour.push(...(classes.get(scan.class[i]) ?? [1, 1, 1]));
    else if (by === "instance") {
      const id = scan.instance[i];
      tint.setHSL((id * 0.618034) % 1, 0.65, 0.6);
      colour.push(...(id === 0 ? [0.35, 0.37, 0.39] : [tint.r, tint.g, tint.b]));
    } else if (by === "intensity") colour.push(...ramp(Math.sqrt(scan.intensity[i] / 255)));
    else if (by === "time") colour.push(...ramp(scan.time[i] / 65535));
    else if (by === "height") colour.push(...ramp((height(i) - low) / (high - low || 1)));
    else {
      const p = scan.position.subarray(3 * i, 3 * i + 3);
      colour.push(...ramp(Math.hypot(p[0], p[1], p[2]) / 60));
    }
  }
  if (cloud) {
    scene.remove(cloud);
    cloud.geometry.dispose();
    cloud.material.dispose();
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(kept), 3));
  geometry.setAttribute("tint", new THREE.BufferAttribute(new Float32Array(colour), 3));
  const material = new THREE.ShaderMaterial({
    uniforms: { size: { value: get("size").value * Math.min(devicePixelRatio, 2) } },
    vertexShader: `attribute vec3 tint; varying vec3 colour; uniform float size;
      void main() {
        colour = tint;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
        gl_PointSize = size * clamp(24.0 / gl_Position.w, 0.7, 2.5);
      }`,
    fragmentShader: "varying vec3 colour; void main() { gl_FragColor = vec4(colour, 1.0); }",
  });
  cloud = new THREE.Points(geometry, material);
  scene.add(cloud);
  drawScan();
}

function drawScan() {
  if (!renderer || !cloud) return;
  const { clientWidth: width, clientHeight: height } = get("cloud");
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setSize(width, height, false);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
  renderer.render(scene, camera);
}
get("lidar").addEventListener("change", showScan);
for (const id of ["colour", "size"]) get(id).addEventListener("input", colourScan);
get("behind").onclick = () => controls && look([-13, -4, 7], [12, 0, 0]);
get("top").onclick = () => controls && look([-0.01, 0, 80], [0, 0, 0]);

// Classes.
attempt("shares", () => {
  const widest = Math.max(1e-9, ...data.classes.map((c) =>
    Math.max(c.pixels / (pixels || 1), c.points / (points || 1))));
  get("classes").append(...data.classes.map((c) => {
    const row = make("div", { className: "share" }, make("b", { textContent: c.name }));
    for (const [kind, part, all] of [["pixels", c.pixels, pixels], ["points", c.points, points]]) {
      const bar = make("div", { className: kind });
      bar.style.cssText = `width: ${100 * part / (all || 1) / widest}%; background: ${rgb(c.colour)}`;
      row.append(bar, make("small", { textContent: all ? `${percent(part / all)}` : "–", title: kind }));
    }
    return row;
  }), make("p", { className: "hint", textContent: "Upper bars: pixels of all cameras. Lower bars: points of all LiDARs." }));
});

// Inventory.
// Seedlings are lower than breast height.
const trees = data.sequences.flatMap((s) => s.trees).filter((t) => t[3] > 0);
function plot(title, xs, xLabel, draw, into = get("plots")) {
  const root = svg("svg", { viewBox: "0 0 360 220", role: "img", "aria-label": title });
  const top = Math.max(...xs, 1e-9);
  // However large the numbers are, there are at most 50 steps.
  const step = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].find((s) => top / s <= 7)
    ?? Math.max(100, 10 ** Math.floor(Math.log10(top / 5)));
  const x = (v) => 34 + 316 * v / (step * Math.ceil(top / step));
  root.append(svg("line", { x1: 34, x2: 350, y1: 190, y2: 190, class: "axis" }));
  for (let v = 0; v <= top + step; v += step) {
    if (x(v) > 351) break;
    root.append(svg("text", { x: x(v), y: 204, "text-anchor": "middle" }, Number(fixed(v, 2))));
  }
  root.append(svg("text", { x: 350, y: 218, "text-anchor": "end" }, xLabel));
  draw(root, x, step * Math.ceil(top / step));
  into.append(make("figure", {}, make("figcaption", { textContent: title }), root));
}
function histogram(title, field, xLabel) {
  const values = trees.map((t) => t[field]);
  plot(title, values, xLabel, (root, x, top) => {
    const bins = Array.from({ length: 28 }, () => new Map());
    trees.forEach((t) => {
      const bin = bins[Math.max(0, Math.min(27, Math.floor(28 * t[field] / top)))];
      bin.set(t[0], (bin.get(t[0]) ?? 0) + 1);
    });
    const most = Math.max(...bins.map((b) => [...b.values()].reduce((a, v) => a + v, 0)));
    bins.forEach((bin, i) => {
      let y = 190;
      [...bin].sort(([a], [b]) => a - b).forEach(([kind, n]) => {
        const height = 170 * n / most;
        y -= height;
        root.append(svg("rect", { x: x(i * top / 28), y, height, width: x(top / 28) - x(0) - 1, fill: hue(kind) }));
      });
    });
    root.append(svg("text", { x: 30, y: 26, "text-anchor": "end" }, most));
  });
}
function showPlots() {
  histogram("Diameters at breast height", 3, "m");
  histogram("Heights", 4, "m");
  plot("Height over diameter", trees.map((t) => t[3]), "diameter, m", (root, x) => {
    const tallest = Math.max(1e-9, ...trees.map((t) => t[4]));
    const every = Math.ceil(trees.length / 3000);
    trees.filter((_, i) => i % every === 0).forEach((t) => root.append(svg("circle",
      { cx: x(t[3]), cy: 190 - 170 * t[4] / tallest, r: 1.8, fill: hue(t[0]), "fill-opacity": 0.6 })));
    root.append(svg("text", { x: 30, y: 26, "text-anchor": "end" }, `${fixed(tallest, 0)} m`));
  });
}
const species = (kind) => [dot(hue(kind)), data.species[kind].replaceAll("_", " ")];
if (trees.length) {
  attempt("inventory", showPlots);
  attempt("inventory", () => {
    get("plots").after(make("div", { id: "species" }, ...data.species.map((_, i) => make("span", {}, ...species(i)))));
  });
}
const head = (...names) => make("tr", {}, ...names.map((n) => make("th", { textContent: n })));
attempt("inventory", () => {
  get("quantiles").append(head("", "least", "5 %", "median", "95 %", "most"),
    ...data.quantiles.filter(([, row]) => row).map(([name, row]) => make("tr", {},
      make("td", { textContent: name }),
      ...row.map((v) => make("td", { className: "n", textContent: fixed(v, 2) })))));
});

// Map.
const ground = get("ground");
let centre = [0, 0];
let scale = 1;
const listed = Map.groupBy(data.frames.map((f, i) => [f, i]), ([f]) => f.sequence);
const framesOf = (number) => listed.get(number) ?? [];
const theWorld = () => data.sequences.find((s) => s.number === Number(get("world").value));
attempt("map", () => {
  get("world").append(...data.sequences.map((s) => make("option",
    { value: s.number, textContent: `sequence ${s.number}${s.split ? ` (${s.split})` : ""}` })));
});
function fitMap() {
  const world = theWorld();
  if (!world) return;
  const at = framesOf(world.number).map(([f]) => f.at);
  if (at.length === 0) return;
  const range = (k) => [Math.min(...at.map((p) => p[k])) - 25, Math.max(...at.map((p) => p[k])) + 25];
  const [[west, east], [south, north]] = [range(0), range(1)];
  centre = [(west + east) / 2, (south + north) / 2];
  scale = Math.min(ground.clientWidth / (east - west), ground.clientHeight / (north - south));
}
function drawMap() {
  const world = theWorld();
  if (!world || !ground.clientWidth) return;
  const ratio = devicePixelRatio;
  const [width, height] = [ground.clientWidth, ground.clientHeight];
  ground.width = width * ratio;
  ground.height = height * ratio;
  const to = ([x, y]) => [width / 2 + (x - centre[0]) * scale, height / 2 - (y - centre[1]) * scale];
  const c = ground.getContext("2d");
  const ink = getComputedStyle(document.body).color;
  c.scale(ratio, ratio);
  for (const pass of ["crown", "stem"]) {
    for (const [kind, x, y, dbh, , crown] of world.trees) {
      const [u, v] = to([x, y]);
      const r = scale * (pass === "crown" ? crown : dbh / 2);
      if (u < -r || v < -r || u > width + r || v > height + r) continue;
      c.globalAlpha = pass === "crown" ? 0.28 : 1;
      c.fillStyle = pass === "crown" ? hue(kind) : ink;
      c.beginPath();
      c.arc(u, v, Math.max(pass === "crown" ? 1.5 : 0.8, r), 0, 7);
      c.fill();
    }
  }
  c.globalAlpha = 1;
  const frames = framesOf(world.number);
  c.strokeStyle = "#e5484d";
  c.lineWidth = 2;
  c.beginPath();
  frames.forEach(([f], i) => (i ? c.lineTo(...to(f.at)) : c.moveTo(...to(f.at))));
  c.stroke();
  for (const [f, i] of frames) {
    if (f.whole === null) continue;
    c.fillStyle = i === current ? "#e5484d" : "#fff";
    c.beginPath();
    c.arc(...to(f.at), i === current ? 7 : 4.5, 0, 7);
    c.fill();
    c.stroke();
  }
  const bar = [1, 2, 5, 10, 20, 50, 100, 200, 500].find((m) => m * scale > 60) ?? 1000;
  c.fillStyle = c.strokeStyle = ink;
  c.fillRect(14, height - 16, bar * scale, 3);
  c.font = "12px system-ui, sans-serif";
  c.fillText(`${bar} m, north is up`, 14, height - 22);
}
let grip = null;
ground.addEventListener("pointerdown", (event) => {
  grip = [event.offsetX, event.offsetY, ...centre, false];
  ground.setPointerCapture(event.pointerId);
});
ground.addEventListener("pointermove", (event) => {
  if (!grip) return;
  const [dx, dy] = [event.offsetX - grip[0], event.offsetY - grip[1]];
  grip[4] ||= Math.hypot(dx, dy) > 4;
  centre = [grip[2] - dx / scale, grip[3] + dy / scale];
  drawMap();
});
ground.addEventListener("pointerup", (event) => {
  if (grip && !grip[4]) {
    const at = [
      centre[0] + (event.offsetX - ground.clientWidth / 2) / scale,
      centre[1] - (event.offsetY - ground.clientHeight / 2) / scale,
    ];
    const far = ([f]) => Math.hypot(f.at[0] - at[0], f.at[1] - at[1]);
    const near = framesOf(theWorld().number).filter(([f]) => f.whole !== null)
      .sort((a, b) => far(a) - far(b))[0];
    if (near) show(near[1]);
  }
  grip = null;
});
ground.addEventListener("wheel", (event) => {
  event.preventDefault();
  scale *= Math.exp(-event.deltaY / 500);
  drawMap();
}, { passive: false });
get("world").addEventListener("change", () => {
  fitMap();
  drawMap();
  const first = framesOf(theWorld().number).find(([f]) => f.whole !== null);
  if (first) show(first[1]);
});
attempt("map", () => {
  get("map").hidden = data.sequences.length === 0;
  get("shown").textContent = "Click on a dot to see its frame." + (data.trees_shown < data.trees_total
    ? ` ${count(data.trees_shown)} of ${count(data.trees_total)} trees are drawn.` : "");
});

// Stems and basal area of a hectare, of the land near the drive, all of whose trees are known.
const visible = data.config.match(/visible_radius_m\s*=\s*([0-9.]+)/);
const NEAR_M = Math.min(20, visible ? Number(visible[1]) : 20);
const THINNEST_M = 0.07;
function density(world) {
  const side = 1;
  const land = new Set();
  const cell = (x, y) => `${Math.floor(x / side)},${Math.floor(y / side)}`;
  const frames = framesOf(world.number);
  const every = Math.ceil(frames.length / 2000);
  for (const [f] of frames.filter((_, i) => i % every === 0)) {
    for (let dx = -NEAR_M; dx <= NEAR_M; dx += side) {
      for (let dy = -NEAR_M; dy <= NEAR_M; dy += side) {
        if (dx * dx + dy * dy <= NEAR_M * NEAR_M) land.add(cell(f.at[0] + dx, f.at[1] + dy));
      }
    }
  }
  const hectares = land.size * side * side / 1e4;
  const near = world.trees.filter(([, x, y, dbh]) => dbh >= THINNEST_M && land.has(cell(x, y)));
  const drawn = data.trees_shown / (data.trees_total || 1) || 1;
  const area = near.reduce((sum, t) => sum + Math.PI / 4 * t[3] * t[3], 0);
  return [near.length / drawn / hectares, area / drawn / hectares];
}
if (trees.length) {
  get("density").textContent = `Stems and basal area per hectare count trees of ${fixed(100 * THINNEST_M, 0)} cm and more within ${NEAR_M} m of the drive.`;
}

// Sequences.
attempt("worlds", () => {
  const keys = [...new Set(data.sequences.flatMap((s) => Object.keys(s.drawn)))].sort();
  const value = (v) => (typeof v === "number" ? Number(v.toPrecision(4)).toString() : String(v ?? ""));
  get("sequences").append(
    head("sequence", "split", "frames", "trees", "stems/ha", "m²/ha", "points by class", ...keys, "seed"),
    ...data.sequences.map((s) => {
      const bar = make("div", { className: "stack" });
      const all = Object.values(s.points).reduce((a, n) => a + n, 0) || 1;
      for (const c of data.classes) {
        const part = make("div", { title: `${c.name} ${percent((s.points[c.id] ?? 0) / all)}` });
        part.style.cssText = `width: ${100 * (s.points[c.id] ?? 0) / all}%; background: ${rgb(c.colour)}`;
        bar.append(part);
      }
      const trees = Object.values(s.counts).reduce((a, n) => a + n, 0);
      const [stems, area] = trees ? density(s) : [0, 0];
      // There is none of a sequence of whose frames no place is listed.
      const dense = Number.isFinite(stems) ? count(Math.round(stems)) : "–";
      const cells = [s.number, s.split ?? "", count(s.frames), count(trees), dense, fixed(area, 1),
        bar, ...keys.map((k) => value(s.drawn[k])), s.seed];
      return make("tr", {}, ...cells.map((cell) => make("td", {}, cell instanceof Node ? cell : String(cell))));
    }));
});

// Provenance.
attempt("provenance", () => {
  const origin = { Generator: data.generator, Renderer: data.backend, Seed: data.seed, Licence: data.licence || "not given" };
  for (const [term, text] of Object.entries(origin)) {
    get("origin").append(make("dt", { textContent: term }), make("dd", { textContent: text }));
  }
  get("config").textContent = data.config;
});

attempt("frames", slide);
attempt("map", fitMap);
attempt("frames", () => show(0));
addEventListener("resize", () => { drawScan(); drawMap(); });
