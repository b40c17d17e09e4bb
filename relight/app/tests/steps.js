// What a person does on the page, step by step, by mouse, finger or keys.

import { createHash } from "node:crypto";

import { settled } from "./browser.js";
import { BALL } from "./photos.js";

/** The place of the page where a part of the photograph is that is being cut out. */
async function onPhoto(page, { width, height }, [x, y]) {
  const box = await page.locator("#cut-canvas").boundingBox();
  const [scale, left, top] = (await page.getAttribute("#cut-canvas", "data-view")).split(" ").map(Number);
  return [box.x + left + x * width * scale, box.y + top + y * height * scale];
}

/** A line by the mouse, or by a finger where there are fingers. */
export async function draw(page, from, to) {
  if (await hasTouch(page)) return touch(page, [[from], [middle(from, to)], [to]]);
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(...middle(from, to), { steps: 3 });
  await page.mouse.move(...to, { steps: 3 });
  return page.mouse.up();
}

const middle = ([a, b], [c, d]) => [(a + c) / 2, (b + d) / 2];

export const hasTouch = (page) => page.evaluate(() => navigator.maxTouchPoints > 0);

/** Fingers on the screen: for each moment the places where they are. */
export async function touch(page, moments) {
  const session = await page.context().newCDPSession(page);
  const points = (places) => places.map(([x, y], id) => ({ x, y, id }));
  for (const [index, places] of moments.entries()) {
    await session.send("Input.dispatchTouchEvent", { type: index === 0 ? "touchStart" : "touchMove", touchPoints: points(places) });
    await page.waitForTimeout(20);
  }
  await session.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await session.detach();
}

/** Two fingers that move apart by a factor and turn by degrees. */
export function pinch(page, [x, y], factor, degrees = 0) {
  const moments = Array.from({ length: 9 }, (_, index) => {
    const part = index / 8;
    const reach = 40 * factor ** part;
    const angle = (degrees * part * Math.PI) / 180;
    const [dx, dy] = [reach * Math.cos(angle), reach * Math.sin(angle)];
    return [[x - dx, y - dy], [x + dx, y + dy]];
  });
  return touch(page, moments);
}

export const choose = (page, photo, field = "#photo-file") => page.setInputFiles(field, photo);

/** Cuts the ball out by a rectangle and strokes of all three brushes. */
export async function cutBall(page, size = { width: 640, height: 480 }) {
  await page.waitForSelector("body.cutting");
  await page.waitForSelector("#cut-canvas[data-view]");
  const [x, y, w, h] = BALL;
  const line = async (from, to) => draw(page, await onPhoto(page, size, from), await onPhoto(page, size, to));
  await line([x, y], [x + w, y + h]);
  await cutIsDone(page);
  await page.click("[data-tool=object]");
  await line([0.45, 0.5], [0.55, 0.5]);
  await page.click("[data-tool=background]");
  await line([0.05, 0.1], [0.2, 0.1]);
  await line([0.05, 0.9], [0.2, 0.9]);
  await page.click("[data-tool=eraser]");
  await line([0.05, 0.9], [0.2, 0.9]);
  await page.click("#cut-undo");
  await page.click("#cut-redo");
  await cutIsDone(page);
}

/** Until the mask is the newest sketch's. */
export const cutIsDone = (page) => page.waitForSelector("#cut-done:enabled");

/** A photograph from its file to its place in the scene. */
export async function addBall(page, photo, size) {
  const before = await page.locator("#objects .entry").count();
  await choose(page, photo);
  await cutBall(page, size);
  await page.click("#cut-done");
  await page.waitForFunction((count) => document.querySelectorAll("#objects .entry").length > count, before);
  await page.waitForSelector("#layers .tile");
  await settled(page);
}

/** Shows the tools of a tab. */
export const tab = (page, name) => page.click(`#tab-${name}`);

/** A slider to a value, as a person's drag ends. */
export async function slide(page, id, value) {
  await page.fill(`#${id}`, String(value));
  await settled(page);
}

/** The middle of the selected object on the page. */
export async function middleOfSelected(page) {
  const { x, y, width, height } = await page.locator("#selection").boundingBox();
  return [x + width / 2, y + height / 2];
}

/** The digest of the picture of the stage when it rests. */
export async function stagePicture(page) {
  await settled(page);
  return createHash("sha256").update(await page.evaluate(() => document.getElementById("picture").toDataURL())).digest("hex");
}

/** Presses something that hands a file out; the file's bytes and name. */
export async function downloaded(page, selector) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(selector)]);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk);
  return { name: download.suggestedFilename(), bytes: Buffer.concat(chunks) };
}

/** The pixels of a picture's file: { width, height, rgba }. */
export async function decoded(page, bytes, type = "image/png") {
  const { width, height, rgba } = await page.evaluate(async ({ text, type }) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type }));
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let binary = "";
    for (let at = 0; at < data.length; at += 32768) binary += String.fromCharCode(...data.subarray(at, at + 32768));
    return { width: image.width, height: image.height, rgba: btoa(binary) };
  }, { text: bytes.toString("base64"), type });
  return { width, height, rgba: Buffer.from(rgba, "base64") };
}

/** The largest difference of two pictures' bytes. */
export function farthest(a, b) {
  if (a.length !== b.length) return Infinity;
  let most = 0;
  for (let at = 0; at < a.length; at++) most = Math.max(most, Math.abs(a[at] - b[at]));
  return most;
}
