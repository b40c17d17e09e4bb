// The page from outside, in Chromium, at the size of a phone and of a desk. The server is stopped as soon as the page is kept.

import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { AxeBuilder } from "@axe-core/playwright";

import { launch, offline, open, settled, SIZES } from "./browser.js";
import { badFiles, ball, exifTurned, panorama } from "./photos.js";
import { serve } from "./server.js";
import * as steps from "./steps.js";

const FOLDER = process.env.RELIGHT_PAGE ?? "../../../target/page";
const SHOTS = process.env.SHOTS;
/** So much of a picture are soft edges of objects brighter than white, where layers of 8 bits lose light. */
const SOFT_EDGE = 1e-3;
/** A captured object. */
const CAPTURED = "../../../tests/fuzz/seeds/captured_object/glossy.relit";

let browser, photo, second;

before(async () => {
  browser = await launch();
  photo = await ball(browser);
  second = await ball(browser, { name: "blue.jpg", hue: 210 });
  if (SHOTS) mkdirSync(SHOTS, { recursive: true });
});
after(() => browser.close());

const shot = (page, name) => SHOTS && page.screenshot({ path: join(SHOTS, `${name}.png`) });

/** The page of a size, kept, with its server stopped. */
async function keptPage(size, options) {
  const server = await serve(FOLDER);
  const { page, problems } = await open(browser, server.address, size, options);
  await offline(page);
  await settled(page);
  await server.stop();
  const requests = [];
  page.context().on("request", (request) => /^https?:/.test(request.url()) && requests.push(request.url()));
  return { page, problems, requests, close: () => page.context().close() };
}

const alertText = (page) => page.textContent("#alert-text");
const range = async (page, id) => Number(await page.inputValue(`#${id}`));

for (const size of Object.keys(SIZES)) {
  test(`${size}: from a photograph to a saved picture, without a server and without a request`, async () => {
    const { page, problems, requests, close } = await keptPage(size);
    await shot(page, `${size}-1-welcome`);
    await steps.choose(page, photo);
    await steps.cutBall(page);
    await shot(page, `${size}-2-cut`);
    await page.click("#cut-done");
    await page.waitForSelector("#layers .tile");
    assert.equal(await page.locator("#layers .tile").count(), 4);
    await page.click("#layers .tile >> nth=2");
    await shot(page, `${size}-3-normals`);
    await page.click("#large-close");

    await steps.tab(page, "scene");
    const first = await steps.stagePicture(page);
    await page.click("#backgrounds button >> nth=3");
    assert.notEqual(await steps.stagePicture(page), first, "another panorama is another picture");
    await shot(page, `${size}-4-scene`);

    await drag(page);
    await sizeAndTurn(page);
    await turnLight(page);
    await moveLamp(page, size);
    await addSecond(page);
    await makeGlossy(page, size);
    await compareBefore(page);
    await save(page, size);

    assert.deepEqual(problems, []);
    assert.deepEqual(requests, [], "nothing was asked after the page was loaded");
    assert.equal(await page.isHidden("#alert"), true, await alertText(page));
    await close();
  });

  test(`${size}: by keys alone`, async () => {
    const { page, problems, close } = await keptPage(size);
    await byKeys(page);
    assert.deepEqual(problems, []);
    await close();
  });

  for (const colorScheme of ["light", "dark"]) {
    test(`${size}, ${colorScheme}: no serious finding of axe`, async () => {
      const { page, close } = await keptPage(size, { colorScheme, reducedMotion: "reduce" });
      await accessible(page, "welcome");
      await steps.choose(page, photo);
      await steps.cutBall(page);
      await accessible(page, "cutting");
      await page.click("#cut-done");
      await page.waitForSelector("#layers .tile");
      for (const name of ["objects", "scene", "light", "material", "save"]) {
        await steps.tab(page, name);
        if (name === "light") await page.check("#by-lamp");
        if (name === "material") await page.check("#glossy");
        await settled(page);
        await accessible(page, name);
        await shot(page, `${size}-${colorScheme}-${name}`);
      }
      await steps.choose(page, { name: "nothing.png", mimeType: "image/png", buffer: Buffer.alloc(0) });
      await page.waitForSelector("#alert:not([hidden])");
      await accessible(page, "alert");
      await shot(page, `${size}-${colorScheme}-alert`);
      await close();
    });
  }
}

async function drag(page) {
  const [x, y] = await steps.middleOfSelected(page);
  await steps.draw(page, [x, y], [x + 50, y - 20]);
  await settled(page);
  const [movedX, movedY] = await steps.middleOfSelected(page);
  assert.ok(Math.abs(movedX - x - 50) < 4, `dragged from ${x} by 50 to ${movedX}`);
  assert.ok(Math.abs(movedY - y + 20) < 4, `dragged from ${y} by -20 to ${movedY}`);
}

async function sizeAndTurn(page) {
  await steps.tab(page, "objects");
  const height = await range(page, "height");
  const at = await steps.middleOfSelected(page);
  if (await steps.hasTouch(page)) {
    await steps.pinch(page, at, 0.7, 20);
    assert.ok(Math.abs((await range(page, "rotation")) + 20) <= 2, `fingers turned it by ${await range(page, "rotation")}`);
  } else {
    await page.mouse.move(...at);
    await page.mouse.wheel(0, 360);
  }
  await settled(page);
  const ratio = (await range(page, "height")) / height;
  assert.ok(ratio > 0.64 && ratio < 0.76, `the height went to ${ratio} of what it was`);
}

async function turnLight(page) {
  await steps.tab(page, "light");
  const before = await steps.stagePicture(page);
  await steps.slide(page, "light-angle", 120);
  assert.notEqual(await steps.stagePicture(page), before, "turned light is seen");
  await page.click("#undo");
  assert.equal(await steps.stagePicture(page), before, "undo brings the picture back");
  await page.click("#redo");
}

async function moveLamp(page, size) {
  await page.check("#by-lamp");
  const before = await steps.stagePicture(page);
  const dial = await page.locator("#dial").boundingBox();
  const [x, y] = [dial.x + dial.width / 2, dial.y + dial.height / 2];
  await steps.draw(page, [x, y], [x - 0.35 * dial.width, y]);
  assert.ok(Math.abs((await range(page, "azimuth")) - 270) <= 3, `the dial's left is ${await range(page, "azimuth")}`);
  const left = await steps.stagePicture(page);
  assert.notEqual(left, before, "the lamp's light moves on the object");
  const lamp = await page.locator("#lamp").boundingBox();
  const from = [lamp.x + lamp.width / 2, lamp.y + lamp.height / 2];
  await steps.draw(page, from, [from[0] + 60, from[1]]);
  const shown = await page.locator("#lamp").boundingBox();
  assert.ok(Math.abs(shown.x - lamp.x - 60) < 4, `the lamp follows from ${lamp.x} by 60 to ${shown.x}`);
  assert.notEqual(await steps.stagePicture(page), left, "so it does from the picture");
  await steps.slide(page, "ambient", 0.3);
  await page.fill("#colour", "#ffc080");
  await settled(page);
  await shot(page, `${size}-5-lamp`);
}

async function addSecond(page) {
  await steps.tab(page, "objects");
  await steps.addBall(page, second);
  assert.equal(await page.locator("#objects .entry").count(), 2);
  await page.click("#backward");
  await page.click("#duplicate");
  assert.equal(await page.locator("#objects .entry").count(), 3);
  await page.click("#remove");
  await settled(page);
  assert.equal(await page.locator("#objects .entry").count(), 2);
}

async function makeGlossy(page, size) {
  await steps.tab(page, "material");
  const dull = await steps.stagePicture(page);
  await page.check("#glossy");
  const glossy = await steps.stagePicture(page);
  assert.notEqual(glossy, dull, "gloss is seen");
  await page.fill("#tint", "#80ff80");
  assert.notEqual(await steps.stagePicture(page), glossy, "tint is seen");
  await shot(page, `${size}-6-material`);
}

async function compareBefore(page) {
  const after = await steps.stagePicture(page);
  const { x, y, width, height } = await page.locator("#before").boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  await page.waitForSelector("#before[aria-pressed=true]");
  assert.notEqual(await steps.stagePicture(page), after, "while it is pressed, the objects are as they were photographed");
  await page.mouse.up();
  assert.equal(await steps.stagePicture(page), after, "let go, it is as it was");
}

async function save(page, size) {
  await steps.tab(page, "save");
  await shot(page, `${size}-7-save`);
  const png = await steps.downloaded(page, "#save-png");
  const picture = await steps.decoded(page, png.bytes);
  assert.deepEqual([png.name, picture.width, picture.height], ["relight.png", 1280, 960]);
  const jpeg = await steps.downloaded(page, "#save-jpeg");
  assert.deepEqual([jpeg.name, jpeg.bytes.readUInt16BE(0)], ["relight.jpg", 0xffd8]);

  const zip = await steps.downloaded(page, "#keep");
  assert.deepEqual([zip.name, zip.bytes.readUInt16BE(0)], ["relight-scene.zip", 0x504b]);
}

/** The whole way, and no pointer. */
async function byKeys(page) {
  const press = async (...keys) => {
    for (const key of keys) await page.keyboard.press(key);
  };
  const chooser = page.waitForEvent("filechooser");
  await focusByTab(page, "welcome-choose");
  await press("Enter");
  await (await chooser).setFiles(photo);
  await page.waitForSelector("body.cutting");
  await page.waitForFunction(() => document.activeElement.id === "cut-canvas");
  const times = (count, key) => Array.from({ length: count }, () => key);
  await press(...times(3, "Shift+ArrowLeft"), ...times(5, "Shift+ArrowUp"), " ");
  await press(...times(6, "Shift+ArrowRight"), ...times(10, "Shift+ArrowDown"), " ");
  await steps.cutIsDone(page);
  await press("o", ...times(3, "Shift+ArrowLeft"), ...times(5, "Shift+ArrowUp"), " ", "ArrowRight", "ArrowRight", " ");
  await steps.cutIsDone(page);
  await focusByTab(page, "cut-done");
  await press("Enter");
  await page.waitForSelector("#layers .tile");
  await settled(page);

  await focusByTab(page, "picture");
  const [x] = await steps.middleOfSelected(page);
  const height = await range(page, "height");
  await press("Shift+ArrowRight", "+", "+", "[", "d");
  await settled(page);
  assert.equal(await page.locator("#objects .entry").count(), 2, "D copies");
  await press("Delete");
  assert.equal(await page.locator("#objects .entry").count(), 1, "Delete removes");
  assert.ok((await steps.middleOfSelected(page))[0] > x, "the arrow moved it");
  assert.ok((await range(page, "height")) > height, "plus made it larger");
  assert.equal(await range(page, "rotation"), 5);
  await press("Control+z", "Control+z", "Control+Shift+z");
  assert.equal(await page.locator("#objects .entry").count(), 2, "undo twice and redo once: the copy is there");

  await focusByTab(page, "before");
  const after = await steps.stagePicture(page);
  await press("Enter");
  assert.equal(await page.getAttribute("#before", "aria-pressed"), "true");
  assert.notEqual(await steps.stagePicture(page), after);
  await press("Enter");
  assert.equal(await steps.stagePicture(page), after);

  await focusByTab(page, "tab-objects");
  await press("ArrowRight", "ArrowRight");
  await focusByTab(page, "by-background");
  await press("ArrowRight");
  assert.equal(await page.isChecked("#by-lamp"), true);
  await focusByTab(page, "azimuth");
  await press("PageUp");
  assert.ok((await range(page, "azimuth")) > 45);
  await focusByTab(page, "tab-light");
  await press("ArrowRight", "ArrowRight");
  await focusByTab(page, "save-png");
  const [saved] = await Promise.all([page.waitForEvent("download"), press("Enter")]);
  assert.equal(saved.suggestedFilename(), "relight.png");
}

/** Presses the tabulator until something has the focus. */
async function focusByTab(page, id) {
  for (let presses = 0; presses < 80; presses++) {
    if (await page.evaluate((id) => document.activeElement.id === id, id)) return;
    await page.keyboard.press("Tab");
  }
  assert.fail(`the tabulator does not reach ${id}`);
}

/** Fails with what axe finds that is serious. */
async function accessible(page, state) {
  const { violations } = await new AxeBuilder({ page }).analyze();
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  const told = serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(" ")).join(", ")}`);
  assert.deepEqual(told, [], state);
}

test("what is no photograph is refused by a sentence, and the page stays in use", async () => {
  const { page, problems, close } = await keptPage("desk");
  for (const file of await badFiles(browser)) {
    await steps.choose(page, file);
    await page.waitForFunction(() => document.getElementById("alert-text").textContent);
    const text = await alertText(page);
    assert.match(text, /^[^.]*\S.*\.$/s, `${file.name}: a sentence`);
    assert.ok(!/crashed|went wrong in the page/.test(text), `${file.name}: ${text}`);
    await page.click("#alert-close");
  }
  await steps.addBall(page, photo);
  for (let copies = 1; copies < 12; copies++) await page.click("#duplicate");
  assert.equal(await page.locator("#objects .entry").count(), 12);
  await page.click("#duplicate");
  assert.match(await alertText(page), /at most 12/);
  await steps.choose(page, second);
  assert.match(await alertText(page), /at most 12/);
  assert.equal(await page.locator("#objects .entry").count(), 12);
  assert.deepEqual(problems, []);
  await close();
});

test("backgrounds of one's own: a panorama and a photograph", async () => {
  const { page, close } = await keptPage("desk");
  await steps.addBall(page, photo);
  await steps.tab(page, "scene");
  const bundled = await steps.stagePicture(page);
  await steps.choose(page, await panorama(browser), "#own-panorama-file");
  await page.waitForFunction(() => document.getElementById("status").textContent.startsWith("hall.jpg"));
  const own = await steps.stagePicture(page);
  assert.notEqual(own, bundled);
  await steps.choose(page, second, "#own-photo-file");
  await page.waitForFunction(() => document.getElementById("status").textContent.startsWith("blue.jpg"));
  assert.notEqual(await steps.stagePicture(page), own);
  assert.equal(await page.isHidden("#shape"), true, "a photograph has its own shape");
  await shot(page, "desk-8-own-photo");
  await page.click("#undo");
  assert.equal(await steps.stagePicture(page), own);
  assert.equal(await page.isHidden("#alert"), true, await alertText(page));
  await close();
});

test("a video of the turning light", async () => {
  const { page, close } = await keptPage("desk");
  await steps.addBall(page, photo);
  await steps.tab(page, "save");
  await page.selectOption("#video-seconds", "3");
  const { name, bytes } = await steps.downloaded(page, "#video");
  const isMp4 = bytes.toString("latin1", 4, 8) === "ftyp";
  const isWebm = bytes.readUInt32BE(0) === 0x1a45dfa3;
  assert.ok(name === "relight.mp4" ? isMp4 : isWebm, `${name} begins with ${bytes.subarray(0, 8).toString("hex")}`);
  const seconds = await page.evaluate(lengthOf, bytes.toString("base64"));
  assert.ok(Math.abs(seconds - 3) < 0.4, `it has ${seconds} s`);
  await close();
});

/** Runs in the page: how long a video is, by going to its end. */
async function lengthOf(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const video = Object.assign(document.createElement("video"), { src: URL.createObjectURL(new Blob([bytes])), muted: true });
  await new Promise((resolve, reject) => Object.assign(video, { onloadedmetadata: resolve, onerror: () => reject(video.error) }));
  video.currentTime = 1e6;
  await new Promise((resolve) => (video.onseeked = resolve));
  return video.currentTime;
}

test("opened again without a network, the page is there", async () => {
  const { page, close } = await keptPage("phone");
  await page.reload();
  await page.waitForFunction(() => !document.body.classList.contains("starting"));
  await settled(page);
  await close();
});

test("without WebGL the same picture is painted plainly", async () => {
  const server = await serve(FOLDER);
  const [layered, plain] = [await ballOnStage(server), await ballOnStage(server, withoutWebGl)];
  assert.deepEqual([layered.width, layered.height], [plain.width, plain.height]);
  const far = layered.rgba.reduce((count, value, index) => count + (Math.abs(value - plain.rgba[index]) > 2), 0) / plain.rgba.length;
  assert.ok(far <= SOFT_EDGE, `${far} of the layers' values differ from the picture's by more than 2 / 255`);
  await server.stop();
});

/** The pixels of the stage with a ball that was moved by a key. */
async function ballOnStage(server, script) {
  const { page } = await open(browser, server.address, "desk", { script });
  await settled(page);
  await steps.addBall(page, photo);
  const before = await steps.stagePicture(page);
  await page.focus("#picture");
  await page.keyboard.press("Shift+ArrowLeft");
  assert.notEqual(await steps.stagePicture(page), before);
  const url = await page.evaluate(() => document.getElementById("picture").toDataURL());
  const pixels = await steps.decoded(page, Buffer.from(url.split(",")[1], "base64"));
  await page.context().close();
  return pixels;
}

/** Runs in the page. */
function withoutWebGl() {
  const get = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind === "webgl2" ? null : get.call(this, kind, ...rest);
  };
}

test("photographs are opened as they are displayed, of every kind that cameras write", async () => {
  const { page, close } = await keptPage("desk");
  const upright = await ball(browser, { name: "upright.webp", width: 640, height: 480 });
  const turned = exifTurned(await ball(browser, { name: "turned.jpg", width: 640, height: 480 }));
  for (const [file, width, height] of [[upright, 640, 480], [turned, 480, 640]]) {
    await steps.choose(page, file);
    await page.waitForFunction((name) => document.getElementById("cut-name").textContent === name, file.name);
    await page.waitForSelector("body.cutting #cut-canvas[data-view]");
    await page.waitForFunction(isCutOfShape, width / height);
    await steps.cutBall(page, { width, height });
    await page.click("#cut-done");
    await page.waitForFunction((name) => document.querySelector("#objects .entry")?.textContent === name, file.name);
  }
  assert.equal(await page.isHidden("#alert"), true, await alertText(page));
  await close();
});

test("an object before a plain background is found, and stands in the scene without being drawn", async () => {
  const { page, close } = await keptPage("phone");
  await steps.choose(page, await ball(browser));
  await page.waitForSelector("body.cutting");
  await steps.cutIsDone(page);
  await page.click("#cut-done");
  await page.waitForSelector("#objects .entry");
  assert.equal(await page.isHidden("#alert"), true, await alertText(page));
  await close();
});

test("a captured object stands in the scene without being cut out", async () => {
  const { page, close } = await keptPage("phone");
  const empty = await steps.stagePicture(page);
  await steps.choose(page, { name: "glossy.relit", mimeType: "application/octet-stream", buffer: readFileSync(CAPTURED) });
  await page.waitForSelector("#objects .entry");
  await page.waitForSelector("#selection:not([hidden])");
  assert.notEqual(await steps.stagePicture(page), empty);
  assert.equal(await page.isHidden("#alert"), true, await alertText(page));
  await close();
});

/** Runs in the page: whether the photograph that is being cut out is so many times as wide as high, as it lies in the middle of its
 * canvas. */
function isCutOfShape(shape) {
  const canvas = document.getElementById("cut-canvas");
  const [, left, top] = canvas.dataset.view.split(" ").map(Number);
  const { width, height } = canvas.getBoundingClientRect();
  return Math.abs((width - 2 * left) / (height - 2 * top) - shape) < 0.02;
}

test("a browser without WebAssembly is told so in a sentence", async () => {
  const server = await serve(FOLDER);
  const { page } = await open(browser, server.address, "desk", { script: () => delete window.WebAssembly });
  await page.waitForSelector("body.dead");
  assert.match(await page.textContent("#loading"), /cannot run relight/);
  await page.context().close();
  await server.stop();
});

test("after a fault the engine is started again with all that it held", async () => {
  const server = await serve(FOLDER, { instead: FAULTY_WORKER });
  const { page } = await open(browser, server.address, "desk");
  await settled(page);
  await steps.addBall(page, photo);
  const before = await steps.stagePicture(page);
  await steps.tab(page, "save");
  await page.click("#save-png");
  await page.waitForSelector("#alert:not([hidden])");
  await page.waitForFunction(() => document.getElementById("alert-text").textContent.includes("was started again"));
  assert.match(await alertText(page), /made by the test/);
  assert.equal(await steps.stagePicture(page), before);
  await page.click("#tab-light");
  await steps.slide(page, "light-angle", 90);
  assert.notEqual(await steps.stagePicture(page), before);
  await page.context().close();
  await server.stop();
});

/** A worker that answers the question for a saved picture with a fault. */
const FAULTY_WORKER = {
  "worker.js": (text) => `import "./fault.js";\n${text}`,
  "fault.js": () => `self.addEventListener("message", (event) => {
    if (event.data.fields?.op !== "save") return;
    event.stopImmediatePropagation();
    self.postMessage({ id: event.data.id, fault: "made by the test" });
  });`,
};
