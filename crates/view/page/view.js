"use strict";
// Everything is asked below the page's own address, which has the token.
const get = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const canvas = get("picture");
const pen = canvas.getContext("2d", { alpha: false });
const viewer = crypto.getRandomValues(new Uint32Array(1))[0];
const reduced = matchMedia("(pointer: coarse)").matches;

// Where you are. Metres east and north, degrees clockwise from north and downwards.
const you = { x: 0, y: 0, heading: 0, pitch: 0, eye: 1.7 };
const WALK = 1.7, RUN = 6, TURN = 75;
let map = "colour";
let state = null;      // what the program said last
let started = false;

// Pictures. Drafts while something moves, then one whole picture.
const draft = { area: 480 * 270, milliseconds: 80 };
let active = 0;        // until when something moves, milliseconds
let fresh = false;     // whether what is seen is whole
let asking = null;     // the request for a whole picture, which moving gives up
let drawing = Promise.resolve();  // until the newest draft is drawn
let arrived = 0;       // when the newest draft arrived, milliseconds
const touch = () => { active = performance.now() + 220; fresh = false; asking?.abort(); };

function size(still) {
  const ratio = Math.max(innerWidth, 1) / Math.max(innerHeight, 1);
  const most = state ? state.size_px[0] * state.size_px[1] : 1280 * 720;
  const area = still ? Math.min(most, innerWidth * innerHeight * devicePixelRatio ** 2) : draft.area;
  const side = (v) => Math.min(2560, Math.max(16, Math.round(v / 2) * 2));
  return [side(Math.sqrt(area * ratio)), side(Math.sqrt(area / ratio))];
}

function query(still) {
  const [width, height] = size(still);
  return new URLSearchParams({
    x: you.x, y: you.y, heading: you.heading, pitch: you.pitch, eye: you.eye,
    map, width, height, still: Number(still), viewer,
  });
}

const wait = (ms) => new Promise((done) => setTimeout(done, ms));
let last = performance.now();

async function look() {
  for (;;) {
    const moves = step();
    const still = !moves && performance.now() > active;
    if (!started || (still && fresh) || document.hidden) { await wait(started ? 30 : 120); continue; }
    try {
      await picture(still);
      lost(false);
    } catch (error) {
      if (error.name !== "AbortError") { lost(true); await wait(1000); }
    }
  }
}

async function picture(still) {
  const abort = asking = still ? new AbortController() : null;
  const began = performance.now();
  const [from, asked] = [{ ...you }, map];
  const answer = await fetch("picture?" + query(still), { signal: abort?.signal });
  if (answer.status === 204) return wait(60);
  if (!answer.ok) { complain((await answer.json()).error); return wait(500); }
  const [x, y] = answer.headers.get("X-Place").split(" ").map(Number);
  // The program keeps you out of stems.
  you.x += x - from.x; you.y += y - from.y;
  // The next draft is asked for while this one is decoded and drawn.
  const before = drawing;
  drawing = draw(answer, before, still);
  if (still) {
    const drawn = await drawing;
    fresh = drawn && !abort.signal.aborted && answer.headers.get("X-Final") === "1" && asked === map;
    if (!fresh) await wait(250);
  } else {
    // As large as is smooth: some twelve pictures a second.
    const took = performance.now() - Math.max(began, arrived);
    arrived = performance.now();
    await before;
    draft.milliseconds += (took - draft.milliseconds) * 0.2;
    draft.area = Math.min(960 * 540, Math.max(320 * 180, draft.area * (draft.milliseconds > 88 ? 0.97 : 1.02)));
  }
  document.documentElement.dataset.final = Number(still && fresh);
}

// Draws an answer's picture after the one before it. The result is whether it has arrived whole.
async function draw(answer, before, still) {
  const arriving = answer.blob().then(createImageBitmap).catch(() => null);
  await before;
  const bitmap = await arriving;
  if (!bitmap) return false;
  const { dataset } = document.documentElement;
  dataset.pictures = Number(dataset.pictures ?? 0) + 1;
  if (!still) Object.assign(dataset, { draftWidth: bitmap.width, draftHeight: bitmap.height });
  show(bitmap);
  return true;
}

function show(bitmap) {
  const scale = Math.min(2, devicePixelRatio);
  const [width, height] = [Math.round(innerWidth * scale), Math.round(innerHeight * scale)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  // A camera that keeps its shape is shown whole.
  const fit = Math.min(width / bitmap.width, height / bitmap.height);
  const almost = Math.abs(bitmap.width / bitmap.height / (width / height) - 1) < 0.02;
  const [w, h] = almost ? [width, height] : [bitmap.width * fit, bitmap.height * fit];
  if (!almost) { pen.fillStyle = "#0b0e0c"; pen.fillRect(0, 0, width, height); }
  pen.imageSmoothingEnabled = map === "colour" || map === "lidar" || map === "depth";
  pen.imageSmoothingQuality = "high";
  pen.drawImage(bitmap, (width - w) / 2, (height - h) / 2, w, h);
  bitmap.close();
}

// Moving.
const keys = new Set();
const stick = { x: 0, y: 0 };
function step() {
  const now = performance.now();
  const dt = Math.min(0.25, (now - last) / 1000);
  last = now;
  const held = (...codes) => Number(codes.some((c) => keys.has(c)));
  const ahead = held("KeyW", "ArrowUp") - held("KeyS", "ArrowDown") - stick.y;
  const right = held("KeyD") - held("KeyA") + stick.x;
  const turn = held("ArrowRight", "KeyE") - held("ArrowLeft", "KeyQ");
  const rise = held("PageUp", "KeyR") - held("PageDown", "KeyF");
  if (!ahead && !right && !turn && !rise) return false;
  const speed = (keys.has("ShiftLeft") || keys.has("ShiftRight") ? RUN : WALK) * Math.max(1, you.eye / 4);
  const length = Math.max(1, Math.hypot(ahead, right));
  const angle = you.heading * Math.PI / 180;
  const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
  you.x += (ahead * sin + right * cos) / length * speed * dt;
  you.y += (ahead * cos - right * sin) / length * speed * dt;
  turnBy(turn * TURN * dt, 0);
  if (rise) setEye(you.eye * 2.5 ** (rise * dt));
  touch();
  get("hint").classList.add("gone");
  where();
  return true;
}

function turnBy(heading, pitch) {
  you.heading = ((you.heading + heading + 540) % 360) - 180;
  you.pitch = Math.min(89, Math.max(-89, you.pitch + pitch));
  where();
}

function where() {
  const names = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];
  const name = names[Math.round(((you.heading + 360) % 360) / 45) % 8];
  get("where").textContent = `${name} · ${you.x.toFixed(0)} m E, ${you.y.toFixed(0)} m N`;
  for (const [id, what] of [["save-view", "view"], ["save-drive", "drive"]]) {
    get(id).href = `config?what=${what}&` + query(true);
  }
}

addEventListener("keydown", (e) => {
  if (e.target.matches("input:not([type=range]), select") || e.ctrlKey || e.metaKey || e.altKey) return;
  const number = Number(e.key) - 1;
  if (state && state.maps[number]) choose(state.maps[number]);
  else if (e.code === "KeyH") panel(get("panel").hidden);
  else if (e.code === "Escape") panel(false);
  else if (e.code === "Home") toStart();
  else if (/^(Key[WASDQERF]|Shift|Page)/.test(e.code)) keys.add(e.code);
  else if (/^Arrow/.test(e.code) && !e.target.matches("input")) keys.add(e.code);
  else return;
  if (!/^Shift/.test(e.code)) e.preventDefault();
});
addEventListener("keyup", (e) => keys.delete(e.code));
addEventListener("blur", () => keys.clear());
addEventListener("resize", touch);

const held = new Map();
canvas.addEventListener("pointerdown", (e) => {
  canvas.setPointerCapture(e.pointerId);
  held.set(e.pointerId, [e.clientX, e.clientY]);
  canvas.classList.add("held");
  canvas.focus({ preventScroll: true });
  if (innerWidth <= 700) panel(false);
});
canvas.addEventListener("pointermove", (e) => {
  const before = held.get(e.pointerId);
  if (!before) return;
  const degrees = 80 / Math.max(innerWidth, innerHeight);
  turnBy((before[0] - e.clientX) * degrees, (before[1] - e.clientY) * degrees);
  held.set(e.pointerId, [e.clientX, e.clientY]);
  get("hint").classList.add("gone");
  touch();
});
for (const end of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(end, (e) => {
    held.delete(e.pointerId);
    if (held.size === 0) canvas.classList.remove("held");
  });
}
canvas.addEventListener("wheel", (e) => {
  e.preventDefault();
  const angle = you.heading * Math.PI / 180;
  const metres = Math.max(-1, Math.min(1, -e.deltaY / 100));
  you.x += metres * Math.sin(angle);
  you.y += metres * Math.cos(angle);
  where();
  touch();
}, { passive: false });

const pad = get("stick");
pad.addEventListener("pointerdown", (e) => pad.setPointerCapture(e.pointerId));
pad.addEventListener("pointermove", (e) => {
  if (!pad.hasPointerCapture(e.pointerId)) return;
  const box = pad.getBoundingClientRect();
  const [x, y] = [(e.clientX - box.x) / box.width * 2 - 1, (e.clientY - box.y) / box.height * 2 - 1];
  const length = Math.max(1, Math.hypot(x, y));
  [stick.x, stick.y] = [x / length, y / length];
  pad.firstElementChild.style.transform = `translate(${stick.x * 40}px, ${stick.y * 40}px)`;
});
for (const end of ["pointerup", "pointercancel"]) {
  pad.addEventListener(end, () => {
    stick.x = stick.y = 0;
    pad.firstElementChild.style.transform = "";
  });
}

// What is shown.
function choose(name) {
  map = name;
  for (const button of get("maps").children) button.ariaPressed = String(button.value === name);
  get("legend").hidden = !["classes", "lidar"].includes(name);
  fresh = false;
  asking?.abort();
  where();
}

// Settings.
function panel(open) {
  get("panel").hidden = !open;
  get("open").ariaExpanded = String(open);
}
get("open").onclick = () => panel(true);
get("close").onclick = () => panel(false);

const EYE = [0.3, 40];
function setEye(metres) {
  you.eye = Math.round(Math.min(EYE[1], Math.max(EYE[0], metres)) * 100) / 100;
  get("eye").value = Math.log(you.eye / EYE[0]) / Math.log(EYE[1] / EYE[0]);
  get("eye-value").textContent = `${you.eye.toFixed(you.eye < 10 ? 2 : 1)} m`;
  where();
}
get("eye").oninput = (e) => { setEye(EYE[0] * (EYE[1] / EYE[0]) ** e.target.value); touch(); };

function toStart() {
  if (!state?.start) return;
  [you.x, you.y, you.heading] = state.start;
  you.pitch = 0;
  setEye(state.eye_m);
  touch();
}
get("start").onclick = toStart;

const said = {
  "h": (v) => `${String(Math.floor(v)).padStart(2, "0")}:${String(Math.floor(v % 1 * 60)).padStart(2, "0")}`,
  "": (v, c) => c.max === 1 ? `${Math.round(v * 100)} %` : v.toFixed(1),
  "m": (v) => v >= 2000 ? `${(v / 1000).toFixed(v < 10000 ? 1 : 0)} km` : `${Math.round(v / 10) * 10} m`,
  "mm/h": (v) => v === 0 ? "none" : `${v.toFixed(1)} mm/h`,
  "/m": (v) => v === 0 ? "none" : `sight ${Math.round(3.912 / v)} m`,
  "/ha": (v) => `${Math.round(v)} per ha`,
  "cm": (v) => v === 0 ? "none" : `${Math.round(v)} cm`,
  "day": (v) => new Date(2023, 0, Math.min(v, 365)).toLocaleDateString("en-GB", { day: "numeric", month: "long" }),
  "°": (v) => `${Math.round(v)}°`,
  "lm": (v) => v === 0 ? "off" : `${Math.round(v)} lm`,
  "EV": (v) => `EV ${v}`,
};
const sliders = new Map();
const toSlider = (c, v) => c.step ? v : Math.log(v / c.min) / Math.log(c.max / c.min);
const fromSlider = (c, t) => c.step ? t : Number((c.min * (c.max / c.min) ** t).toPrecision(3));

function build() {
  let group = null;
  let section = null;
  for (const c of state.controls) {
    if (c.group !== group) {
      group = c.group;
      get("sliders").append(section = make("section", {}, make("h2", { textContent: group })));
    }
    const [min, max, step] = c.step ? [c.min, c.max, c.step] : [0, 1, 0.002];
    const input = Object.assign(make("input"), { type: "range", min, max, step, id: c.name });
    const output = make("output");
    const tell = () => { output.textContent = said[c.unit](fromSlider(c, Number(input.value)), c); };
    input.oninput = () => { tell(); change(c.name, fromSlider(c, Number(input.value))); };
    section.append(make("label", { className: "slider" }, make("span", { textContent: c.label }), output, input));
    sliders.set(c.name, { c, input, tell });
  }
  get("stand").append(
    ...state.stands.map(([name]) => make("option", { value: name, textContent: name.replaceAll("-", " ") })),
    make("option", { value: "", textContent: "of your config", hidden: true }),
  );
  get("maps").append(...state.maps.map((name, i) => {
    const label = name === "lidar" ? "LiDAR" : name[0].toUpperCase() + name.slice(1);
    return make("button", { type: "button", value: name, textContent: label, title: `Key ${i + 1}`, onclick: () => choose(name) });
  }));
  get("legend").append(...state.classes.map(([name, colour]) => {
    const dot = make("i");
    dot.style.background = `rgb(${colour.join(" ")})`;
    return make("div", {}, dot, name);
  }));
  get("backend").textContent = `Rendered by ${state.backend === "cpu" ? "the processor" : state.backend}. Keys: arrows turn, R and F change your height, Home goes back, H hides this.`;
  choose("colour");
}

// The newest change is sent when the one before was taken.
let changes = null;
let sending = false;
function change(name, value) {
  changes = { ...changes, [name]: value };
  if (!sending) send();
}
async function send() {
  sending = true;
  while (changes) {
    const body = JSON.stringify(changes);
    changes = null;
    try {
      const answer = await fetch("change", { method: "POST", body });
      const said = await answer.json();
      if (answer.ok) take(said);
      else { complain(said.error); take(await (await fetch("state")).json()); }
      touch();
    } catch { lost(true); }
  }
  sending = false;
}
get("stand").onchange = (e) => change("stand", e.target.value);
get("seed").onchange = (e) => change("seed", e.target.value);
get("dice").onclick = () => change("seed", String(crypto.getRandomValues(new Uint32Array(1))[0] % 100000));

let complaint = "";
function complain(text) {
  complaint = text ?? "";
  get("error").textContent = complaint;
  get("error").hidden = !complaint;
  if (complaint) panel(true);
}

// What the program says.
function take(said) {
  const first = !state;
  const shown = state?.shown;
  state = said;
  if (first) build();
  if (said.shown !== shown) touch();
  if (said.error !== complaint && (said.error || complaint === shownError)) complain(said.error);
  shownError = said.error ?? "";
  for (const [name, { c, input, tell }] of sliders) {
    if (document.activeElement === input && (sending || changes)) continue;
    input.value = toSlider(c, said.values[name]);
    tell();
  }
  if (document.activeElement !== get("seed")) get("seed").value = said.values.seed;
  get("stand").value = said.values.stand;
  const stand = said.stands.find(([name]) => name === said.values.stand);
  get("stand-doc").textContent = stand ? stand[1] : "The stand of your config.";
  const growing = said.growing;
  const busy = Boolean(growing) || said.shown !== said.revision;
  const percent = growing?.total ? Math.round(100 * growing.done / growing.total) : 0;
  const what = growing?.what === "land" ? `Growing the land, ${percent} %` : "Growing plants";
  get("status").toggleAttribute("data-busy", busy);
  get("status").lastElementChild.textContent = busy ? `${what} …` : "Grown";
  if (said.start && !started) {
    started = true;
    toStart();
    get("veil").classList.add("gone");
    canvas.focus({ preventScroll: true });
    if (innerWidth > 1000 && !reduced) panel(true);
  }
  if (!started) {
    get("veil-text").textContent = said.error ?? `${what} …`;
    get("veil-bar").firstElementChild.style.width = growing?.what === "land" ? `${40 + 0.6 * percent}%` : "20%";
  }
  document.documentElement.dataset.busy = Number(busy);
}
let shownError = "";

function lost(is) {
  document.documentElement.classList.toggle("lost", is);
  if (is) {
    get("status").toggleAttribute("data-busy", true);
    get("status").lastElementChild.textContent = "The program has ended: start it again and open its address";
  }
}

async function listen() {
  for (;;) {
    try {
      take(await (await fetch("state")).json());
      await wait(!started ? 150 : document.documentElement.dataset.busy === "1" ? 400 : fresh ? 2000 : 800);
    } catch (error) {
      // Not only a program that has ended: a fault of this page, too, should be seen.
      console.error(error);
      lost(true);
      await wait(1500);
    }
  }
}
setEye(1.7);
listen();
look();
