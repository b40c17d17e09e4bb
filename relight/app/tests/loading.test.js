// The page while it loads: what is chosen before the engine is there, what its bar shows, and what it says when loading fails.

import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { launch, offline, open, settled } from "./browser.js";
import { ball, panorama } from "./photos.js";
import { serve } from "./server.js";
import * as steps from "./steps.js";

const FOLDER = process.env.RELIGHT_PAGE ?? "../../../target/page";
const SHOTS = process.env.SHOTS;
const MODULE = "relight.wasm";
const NETWORKS = "weights.safetensors";
/** A visit downloads so many bytes at most. */
const MOST_BYTES = 13e6;
const CAPTURED = { name: "glossy.relit", mimeType: "application/octet-stream", buffer: readFileSync("../../../tests/fuzz/seeds/captured_object/glossy.relit") };

let browser, photo, second;

before(async () => {
  browser = await launch();
  photo = await ball(browser);
  second = await ball(browser, { name: "blue.jpg", hue: 210 });
  if (SHOTS) mkdirSync(SHOTS, { recursive: true });
});
after(() => browser.close());

const shot = (page, name) => SHOTS && page.screenshot({ path: join(SHOTS, `${name}.png`) });

/** The first half of a file is sent at once, the rest when it is released. */
function held() {
  let release;
  const released = new Promise((resolve) => (release = resolve));
  const way = async ({ bytes, send }) => {
    const half = bytes.length >> 1;
    await send(bytes.subarray(0, half));
    await released;
    await send(bytes.subarray(half));
  };
  return { way, release };
}

/** Ways in which a file does not arrive, as options of the server. */
const FAILURES = {
  "the server has no such file": (name) => ({ missing: new Set([name]) }),
  "the connection breaks": (name) => ({
    slowly: {
      [name]: async ({ bytes, send, response }) => {
        await send(bytes.subarray(0, bytes.length >> 1));
        response.destroy();
      },
    },
  }),
  "the server does not answer": (name) => ({ slowly: { [name]: ({ response }) => response.socket.destroy() } }),
};

/** A page whose engine waits until it is released. */
async function waitingPage(size) {
  const { way, release } = held();
  const server = await serve(FOLDER, { slowly: { [MODULE]: way } });
  const { page, problems } = await open(browser, server.address, size);
  const close = async () => {
    await page.context().close();
    await server.stop();
  };
  return { page, problems, release, close };
}

const bar = (page) => page.evaluate(() => {
  const { value, max } = document.getElementById("loading-bar");
  return { value, max, text: document.getElementById("loading-text").textContent };
});

const isStarting = (page) => page.evaluate(() => document.body.classList.contains("starting"));

for (const size of ["phone", "desk"]) {
  test(`${size}: a photograph that is chosen before the engine is there is cut out when it is`, async () => {
    const { page, problems, release, close } = await waitingPage(size);
    await page.waitForFunction(() => document.getElementById("loading-bar").value > 0);
    const { value, max, text } = await bar(page);
    const { files } = JSON.parse(readFileSync(join(FOLDER, "files.json"), "utf8"));
    const scenes = Object.keys(files).filter((name) => name.endsWith(".hdr"));
    const all = [MODULE, ...scenes, NETWORKS].reduce((sum, name) => sum + files[name], 0);
    assert.equal(max, all, "the bar counts the bytes of engine, scenes and networks");
    assert.ok(value > 0 && value < files[MODULE], `${value} of ${max}`);
    assert.match(text, /[\d.]+ of [\d.]+ MB/);
    const chooser = page.waitForEvent("filechooser");
    await page.click("#welcome-choose");
    await (await chooser).setFiles(photo);
    await page.waitForFunction((name) => document.getElementById("status").textContent.includes(name), photo.name);
    await shot(page, `${size}-0-loading`);
    assert.equal(await isStarting(page), true);
    release();
    await steps.cutBall(page);
    assert.equal(await page.textContent("#cut-name"), photo.name);
    await page.click("#cut-done");
    await page.waitForSelector("#layers .tile");
    await page.waitForSelector("#loading", { state: "hidden" });
    assert.equal(await page.isHidden("#alert"), true, await page.textContent("#alert-text"));
    assert.deepEqual(problems, []);
    await close();
  });
}

test("what was chosen early is opened in its order, one after the other", async () => {
  const { page, release, close } = await waitingPage("desk");
  await steps.choose(page, await panorama(browser), "#own-panorama-file");
  await steps.choose(page, photo);
  await steps.choose(page, CAPTURED);
  await steps.choose(page, second, "#camera-file");
  await steps.choose(page, { name: "nothing.png", mimeType: "image/png", buffer: Buffer.alloc(0) });
  release();
  for (const { name } of [photo, second]) {
    await page.waitForFunction((name) => document.getElementById("cut-name").textContent === name, name);
    await steps.cutBall(page);
    await page.click("#cut-done");
  }
  await page.waitForFunction(() => document.getElementById("alert-text").textContent.includes("nothing.png"));
  const names = await page.locator("#objects .entry").allTextContents();
  assert.deepEqual(names, [second.name, CAPTURED.name, photo.name], "the foremost first");
  assert.match(await page.textContent("#backgrounds [aria-pressed=true]"), /hall/);
  await close();
});

test("what was dropped early is opened", async () => {
  const { page, release, close } = await waitingPage("desk");
  await page.evaluate(({ name, mimeType, text }) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], name, { type: mimeType }));
    document.body.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
  }, { ...photo, text: photo.buffer.toString("base64") });
  release();
  await page.waitForSelector("body.cutting");
  assert.equal(await page.textContent("#cut-name"), photo.name);
  await close();
});

for (const name of ["files.json", MODULE, NETWORKS]) {
  for (const [what, failure] of Object.entries(FAILURES)) {
    test(`${name}, ${what}: the page says so, and goes on with what was chosen when it is asked to try again`, async () => {
      const options = failure(name);
      const server = await serve(FOLDER, options);
      const { page } = await open(browser, server.address, "phone");
      await steps.choose(page, photo);
      for (const mended of [false, true]) {
        await page.waitForSelector("#loading-again:not([hidden])");
        assert.match(await page.textContent("#loading-fault"), /^The (engine|networks) could not be loaded: [^]+\.$/);
        await shot(page, `phone-0-failed-${name}`);
        if (mended) {
          options.missing?.clear();
          delete options.slowly?.[name];
        }
        await page.click("#loading-again");
      }
      await page.waitForSelector("body.cutting");
      assert.equal(await page.textContent("#cut-name"), photo.name);
      await page.waitForSelector("#loading", { state: "hidden" });
      await page.context().close();
      await server.stop();
    });
  }
}

test("a damaged engine is said to be damaged", async () => {
  const server = await serve(FOLDER, { instead: { [MODULE]: () => "no engine" } });
  const { page } = await open(browser, server.address, "phone");
  await page.waitForSelector("#loading-again:not([hidden])");
  assert.match(await page.textContent("#loading-fault"), /damaged/);
  await page.context().close();
  await server.stop();
});

test("in a browser that cannot run the engine, what is chosen is answered with the reason", async () => {
  const server = await serve(FOLDER);
  const { page } = await open(browser, server.address, "desk", { script: () => delete window.WebAssembly });
  await steps.choose(page, photo);
  await page.waitForSelector("#alert:not([hidden])");
  assert.match(await page.textContent("#alert-text"), /cannot run relight/);
  await page.context().close();
  await server.stop();
});

test("a visit downloads at most 12 MB", async () => {
  const server = await serve(FOLDER);
  const { page } = await open(browser, server.address, "phone");
  await offline(page);
  const entries = await page.evaluate(() => performance.getEntriesByType("resource").map(({ name, encodedBodySize }) => [name, encodedBodySize]));
  const bytes = entries.reduce((sum, [, bytes]) => sum + bytes, 0);
  assert.ok(entries.some(([name]) => name.endsWith(NETWORKS)));
  assert.ok(bytes > 0 && bytes <= MOST_BYTES, `${bytes} bytes`);
  await page.context().close();
  await server.stop();
});
