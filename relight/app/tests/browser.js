// The system's Chromium, and pages in it at the sizes of a phone and of a desk.

import { existsSync } from "node:fs";
import { chromium } from "playwright-core";

/** Where Chromium is looked for. */
const PLACES = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const QUIET = [
  "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
  "--disable-sync",
];

/** Longest wait for anything, on a machine that is busy with something else, milliseconds; all comes far sooner. */
const LONG = 300_000;

export const SIZES = { phone: { width: 390, height: 844 }, desk: { width: 1280, height: 900 } };

export function launch(...more) {
  const executablePath = PLACES.find((path) => path && existsSync(path));
  if (!executablePath) throw new Error("there is no Chromium: install it, or give its path as CHROMIUM");
  return chromium.launch({ executablePath, args: [...QUIET, ...more], timeout: LONG });
}

/** A page of a size, in a browser of its own: { page, problems }. `problems` has what the page threw or complained of; `script` runs
 * in the page before its own. */
export async function open(browser, address, size, { script, ...options } = {}) {
  const context = await browser.newContext({ viewport: SIZES[size], hasTouch: size === "phone", acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(LONG);
  if (script) await page.addInitScript(script);
  const problems = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  await page.goto(address);
  return { page, problems };
}

/** Until the page can do without a server. */
export const offline = (page) => page.waitForSelector("#offline[data-state=ready]");

/** Until the stage shows the sharp picture of the scene, and the engine has nothing to do. */
export const settled = (page) => page.waitForFunction(() => document.body.dataset.picture === "sharp");
