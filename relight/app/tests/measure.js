// How long the page takes, and how much memory, in the system's Chromium: a table. Give the page's folder as $RELIGHT_PAGE.

import { readFile } from "node:fs/promises";
import { cpus } from "node:os";
import { join } from "node:path";

import { launch, offline, open, settled } from "./browser.js";
import { BALL, ball } from "./photos.js";
import { ask, startEngine } from "./programs.js";
import { serve } from "./server.js";
import { addBall, choose, cutIsDone } from "./steps.js";

const FOLDER = process.env.RELIGHT_PAGE ?? "../../../target/page";
const FRAMES = 60;
const rows = [];

const browser = await launch();
const server = await serve(FOLDER);
const tell = (what, value, goal = "") => rows.push({ what, value, goal });
const usable = (page) => page.evaluate(() => performance.getEntriesByName("relight:usable")[0].startTime);
const ms = (value) => `${value.toFixed(0)} ms`;
const at = (times, part) => [...times].sort((a, b) => a - b)[Math.floor(part * (times.length - 1))];

await start();
await reopened();
await asked();
await inThePage();
await large();

console.log(`${browser.version()}, ${cpus().length} cores of ${cpus()[0].model}`);
for (const { what, value, goal } of rows) console.log(`${what.padEnd(60)} ${value.padStart(16)}  ${goal}`);
await browser.close();
await server.stop();

/** Until the page can be used, on its first visit and without a network's delay. */
async function start() {
  const { page } = await open(browser, server.address, "phone");
  await settled(page);
  tell("usable after navigation, first visit", ms(await usable(page)));
  await page.context().close();
}

async function reopened() {
  const { page } = await open(browser, server.address, "phone");
  await offline(page);
  await page.reload();
  await settled(page);
  tell("usable after navigation, kept", ms(await usable(page)));
  await page.context().close();
}

/** What the engine takes for a question, and for its way to the page and back. */
async function asked() {
  const { page } = await open(browser, server.address, "desk");
  await settled(page);
  await startEngine(page);
  const [width, height] = [1156, 868];
  const rect = BALL.map((part, side) => Math.round(part * (side % 2 ? height : width)));
  await ask(page, "open_photo", { object: 1, name: "ball.png" }, [(await ball(browser, { width, height })).buffer]);
  const stroke = { brush: "object", radius: 12, points: [[0.45 * width, 0.5 * height], [0.55 * width, 0.5 * height]] };
  await ask(page, "mask", { object: 1, rect, strokes: [] });
  const { seconds } = await ask(page, "mask", { object: 1, rect, strokes: [stroke] });
  tell("GrabCut after a stroke, 1.0 megapixel", ms(1000 * seconds), "<= 1000 ms");

  await ask(page, "open_photo", { object: 2, name: "small.png" }, [(await ball(browser, { width: 256, height: 256 })).buffer]);
  await ask(page, "mask", { object: 2, rect: BALL.map((part) => Math.round(256 * part)), strokes: [] });
  tell("first decomposition at 256", ms(1000 * (await ask(page, "decompose", { object: 2 })).seconds), "<= 1200 ms");

  await ask(page, "background", { kind: "panorama_file", name: "room.hdr" }, [await readFile(join(FOLDER, "room.hdr"))]);
  for (const kind of ["background", "lamp"]) {
    const times = await page.evaluate(turned, { scene: sceneOf(kind), frames: FRAMES });
    tell(`turning the light (${kind}), layers at 512: median, p95`, `${ms(at(times, 0.5))}, ${ms(at(times, 0.95))}`, "<= 33 ms");
  }
  await page.context().close();
}

/** Runs in the page: milliseconds of each picture while light is turned. The first, which prepares the object, does not count. */
async function turned({ scene, frames }) {
  const times = [];
  for (let index = 0; index <= frames; index++) {
    const began = performance.now();
    const light = { ...scene.light, angle: 6 * index - 180 };
    await window.testedEngine.ask("layers", { scene: { ...scene, light }, longest: 512 });
    if (index > 0) times.push(performance.now() - began);
  }
  return times;
}

/** Pictures a second of the stage while an object is dragged, and while the light's slider is moved. */
async function inThePage() {
  const { page } = await open(browser, server.address, "phone");
  await settled(page);
  await addBall(page, await ball(browser));
  const { x, y, width, height } = await page.locator("#selection").boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  const times = [];
  for (let step = 0; step < FRAMES; step++) {
    await page.mouse.move(x + width / 2 + step, y + height / 2);
    times.push(await page.evaluate(() => new Promise((resolve) => {
      const began = performance.now();
      requestAnimationFrame(() => requestAnimationFrame(() => resolve((performance.now() - began) / 2)));
    })));
  }
  await page.mouse.up();
  tell("a picture of the screen while dragging: median, p95", `${ms(at(times, 0.5))}, ${ms(at(times, 0.95))}`, "without a graphics card");
  await page.context().close();
}

/** A photograph of 12 megapixels, from its file to its place in the scene. */
async function large() {
  const { page } = await open(browser, server.address, "phone");
  await settled(page);
  const photo = await ball(browser, { name: "large.jpg", width: 4000, height: 3000 });
  await choose(page, photo);
  await page.waitForSelector("#cut-canvas[data-view]");
  await page.focus("#cut-canvas");
  const press = async (count, key) => {
    for (let times = 0; times < count; times++) await page.keyboard.press(key);
  };
  await press(5, "Shift+ArrowLeft");
  await press(7, "Shift+ArrowUp");
  await press(1, " ");
  await press(10, "Shift+ArrowRight");
  await press(14, "Shift+ArrowDown");
  await press(1, " ");
  await cutIsDone(page);
  await page.click("#cut-done");
  await page.waitForSelector("#layers .tile");
  await settled(page);
  const { own, all, most } = await memoryOf();
  tell("the tab's own memory with a photo of 12 megapixels", `${own} MB`, "<= 500 MB");
  tell("the same with what Chromium's tabs share: then, at most", `${all} MB, ${most} MB`);
  await page.context().close();
}

/** The memory of the page's process, which is the largest of all pages': megabytes. */
async function memoryOf() {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  const pages = await Promise.all(processInfo.filter(({ type }) => type === "renderer").map(({ id }) => residentOf(id)));
  return pages.sort((a, b) => b.all - a.all)[0];
}

/** What a process holds for itself, what it holds together with others, and the most of the latter. */
async function residentOf(id) {
  const status = await readFile(`/proc/${id}/status`, "utf8");
  const megabytes = (field) => Math.round(Number(status.match(new RegExp(`${field}:\\s+(\\d+)`))[1]) / 1024);
  return { own: megabytes("RssAnon"), all: megabytes("VmRSS"), most: megabytes("VmHWM") };
}

function sceneOf(kind) {
  return {
    size: [1280, 960], fov: 60, down: 10, match: true, white_balance: "light", exposure: 0,
    light: { angle: 0, ...(kind === "lamp" ? { lamp: "45,45,#ffffff,30", ambient: 0.15 } : {}) },
    objects: [{ object: 1, at: [0.5, 0.9], height: 0.5, rotation: 0, tint: [1, 1, 1], gloss: null, exposure: 0, shadow: 1 }],
  };
}
