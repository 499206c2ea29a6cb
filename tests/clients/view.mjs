// Walks through the page of `nemoral view`, in Chromium:
//     node view.mjs NEMORAL FOLDER-FOR-SCREENSHOTS CHROMIUM [ARGUMENTS-OF-VIEW...]
// Needs the npm package puppeteer-core 25. The page may ask nobody but its own server.
import puppeteer from "puppeteer-core";
import { spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync } from "node:fs";
import { loadavg, tmpdir } from "node:os";
import { join } from "node:path";
const [nemoral, out, executablePath, ...rest] = process.argv.slice(2);
mkdirSync(out, { recursive: true });
const problems = [];
const say = (what, ok) => { console.log(ok ? "ok  " : "FAIL", what); if (!ok) problems.push(what); };
const sleep = (ms) => new Promise((r) => setTimeout(r, ms));

const program = spawn(nemoral, ["view", ...rest], { stdio: ["ignore", "pipe", "inherit"] });
const url = await new Promise((found, ended) => {
  program.stdout.once("data", (line) => found(String(line).trim()));
  program.once("exit", (code) => ended(new Error(`nemoral view ended with ${code}`)));
});
say("an address on the loopback with a token", /^http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]{32}\/$/.test(url));

const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox"] });
const downloads = mkdtempSync(join(tmpdir(), "view-"));
const open = async (width, height, mobile = false) => {
  const p = await browser.newPage();
  p.on("pageerror", (e) => problems.push(String(e)));
  p.on("console", (m) => { if (["error", "warn"].includes(m.type())) problems.push(m.text()); });
  p.on("request", (r) => {
    if (!r.url().startsWith(url) && !/^(blob|data):/.test(r.url())) problems.push("request " + r.url());
  });
  const session = await p.createCDPSession();
  await session.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: downloads });
  await p.setViewport({ width, height, isMobile: mobile, hasTouch: mobile, deviceScaleFactor: 1 });
  await p.goto(url, { waitUntil: "load" });
  return p;
};
const final = (p) => p.waitForFunction(() => {
  const d = document.documentElement.dataset;
  return d.final === "1" && d.busy === "0";
}, { timeout: 300_000, polling: 100 });
const count = (p) => p.evaluate(() => Number(document.documentElement.dataset.pictures ?? 0));
const drawn = (p) => p.$eval("#picture", (c) => c.toDataURL());
const you = (p) => p.evaluate(() => ({ ...you }));

let p = await open(1280, 720);
await final(p);
await p.evaluate(() => panel(false));
await p.screenshot({ path: join(out, "view_desktop.png") });
const first = await drawn(p);
const before = await you(p);

// Drafts at fixed sizes, asked for one after the other while turning, while the page rests.
const place = { x: before.x, y: before.y, pitch: 0, eye: 1.7, map: "colour", still: 0, viewer: 1 };
for (const [width, height] of [[480, 270], [320, 180]]) {
  let [drafts, start] = [0, Date.now()];
  for (; Date.now() - start < 5000; drafts++) {
    const heading = (drafts * 7) % 360 - 180;
    const answer = await fetch(`${url}picture?${new URLSearchParams({ ...place, width, height, heading })}`);
    if (answer.status !== 200) say(`a draft has status ${answer.status}`, false);
    await answer.arrayBuffer();
  }
  const drawn = (1000 * drafts / (Date.now() - start)).toFixed(1);
  say(`${drawn} drafts a second at ${width} x ${height}, load ${loadavg()[0].toFixed(1)}`, drafts > 3);
}

// Walking.
const pictures = await count(p);
const began = Date.now();
await p.keyboard.down("KeyW");
await sleep(3000);
await p.keyboard.up("KeyW");
const seconds = (Date.now() - began) / 1000;
const moving = await count(p) - pictures;
const { draftWidth, draftHeight } = await p.evaluate(() => ({ ...document.documentElement.dataset }));
const walked = await you(p);
const metres = Math.hypot(walked.x - before.x, walked.y - before.y);
const rate = (moving / seconds).toFixed(1);
say(`W walks: ${metres.toFixed(1)} m, ${rate} pictures a second, ${draftWidth} x ${draftHeight} at last`, metres > 2 && moving > 3);
const canvas = await (await p.$("#picture")).boundingBox();
await p.mouse.move(canvas.width / 2, canvas.height / 2);
await p.mouse.down();
await p.mouse.move(canvas.width / 2 + 200, canvas.height / 2 - 60, { steps: 5 });
await p.mouse.up();
const turned = await you(p);
say("dragging looks around", Math.abs(turned.heading - walked.heading) > 5 && turned.pitch !== walked.pitch);
await final(p);
say("another place is another picture", (await drawn(p)) !== first);

// Maps.
const maps = await p.$$eval("#maps button", (all) => all.map((b) => b.value));
say("six maps", maps.join() === "colour,classes,instances,depth,normals,lidar");
const seen = new Set();
for (const [i, name] of maps.entries()) {
  await p.keyboard.press(`Digit${i + 1}`);
  await p.evaluate(() => { document.documentElement.dataset.final = "0"; });
  await final(p);
  seen.add(await drawn(p));
  await p.screenshot({ path: join(out, `view_${name}.png`) });
}
say("each map is another picture", seen.size === maps.length);
await p.click("#maps button");
await p.evaluate(() => { document.documentElement.dataset.final = "0"; });
await final(p);

// Sun, weather, stand.
const colour = await drawn(p);
const slide = async (id, value) => {
  await p.evaluate((id, value) => {
    const input = document.getElementById(id);
    input.value = value;
    input.dispatchEvent(new Event("input"));
    document.documentElement.dataset.final = "0";
  }, id, value);
  await sleep(700);
  await final(p);
};
await p.click("#open");
await slide("hour", 19.5);
const evening = await drawn(p);
say("the evening is another picture", evening !== colour);
say("the sun is low", (await p.$eval("#elevation", (e) => Number(e.value))) < 25);
await p.screenshot({ path: join(out, "view_evening.png") });
await slide("fog", 0.06);
say("fog is another picture", (await drawn(p)) !== evening);
await p.screenshot({ path: join(out, "view_fog.png") });
await slide("fog", 0);
await p.select("#stand", "beech");
await sleep(700);
await p.evaluate(() => { document.documentElement.dataset.final = "0"; });
await final(p);
say("another stand grows", (await p.$eval("#stand-doc", (e) => e.textContent)).includes("Fagus"));
await p.screenshot({ path: join(out, "view_beech.png") });

// Download.
await p.click("#save-view");
const config = await (async () => {
  for (let i = 0; i < 100; i++) {
    const [name] = readdirSync(downloads).filter((n) => n.endsWith(".toml"));
    if (name) return readFileSync(join(downloads, name), "utf8");
    await sleep(100);
  }
  return "";
})();
say("the config has what is seen", /beech = 0\.96/.test(config) && /later_h/.test(config));

// A phone.
const phone = await open(390, 844, true);
await final(phone);
say("nothing is wider than a phone", await phone.evaluate(() => document.documentElement.scrollWidth <= 390));
await phone.screenshot({ path: join(out, "view_phone.png") });
const stood = await you(phone);
const stick = await (await phone.$("#stick")).boundingBox();
const [x, y] = [stick.x + stick.width / 2, stick.y + stick.height / 2];
const finger = await phone.touchscreen.touchStart(x, y);
await finger.move(x, y - 50);
await sleep(1500);
await finger.end();
const moved = await you(phone);
say("the stick walks", Math.hypot(moved.x - stood.x, moved.y - stood.y) > 0.5);
await phone.tap("#open");
await sleep(500);
await phone.screenshot({ path: join(out, "view_phone_panel.png") });

// Strangers.
const status = async (address, headers = {}) => (await fetch(address, { headers })).status;
say("no token, no page", (await status(new URL("/", url))) === 404);
say("another origin is refused", (await status(url, { Origin: "http://evil.example" })) === 403);

await browser.close();
program.kill("SIGINT");
const code = await new Promise((ended) => program.once("exit", ended));
say("Ctrl-C ends it", code === 0);
console.log(problems.length, "problems", problems.join("\n"));
process.exit(problems.length ? 1 : 0);
