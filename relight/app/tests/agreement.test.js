// Page and programs answer the same questions alike: masks, decompositions and pictures of one photograph after the other.
// $RELIGHT and $RELIT_MASK are the programs; $PHOTOS is a folder of photographs, each with NAME.rect ("x y width height") beside it.

import assert from "node:assert/strict";
import { mkdir, mkdtemp, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join, parse } from "node:path";
import { after, before, test } from "node:test";

import { launch, open, settled } from "./browser.js";
import { BALL, ball } from "./photos.js";
import { ask, decompositionOf, maskOf, pictureOf, startEngine } from "./programs.js";
import { serve } from "./server.js";
import { decoded, farthest } from "./steps.js";

const FOLDER = process.env.RELIGHT_PAGE ?? "../../../target/page";
/** Decompositions agree within this, of sRGB values from 0 to 1. */
const NEAR = 1e-2;
/** JPEG is decoded by FFmpeg in relit-mask and by Rust in the page, one step apart: so much of a mask may differ for it. */
const JPEG_SHARE = 0.02;

let browser, server, page, work;

before(async () => {
  browser = await launch();
  server = await serve(FOLDER);
  ({ page } = await open(browser, server.address, "desk"));
  await settled(page);
  await startEngine(page);
  work = await mkdtemp(join(tmpdir(), "relight-agreement-"));
});
after(async () => {
  await rm(work, { recursive: true, force: true });
  await browser.close();
  await server.stop();
});

test("masks, decompositions and pictures agree", { timeout: 1_800_000 }, async (t) => {
  const photos = await (process.env.PHOTOS ? photosOf(process.env.PHOTOS) : madePhotos());
  assert.ok(photos.length > 0, "there are photographs");
  for (const [index, photo] of photos.entries()) await t.test(photo.name, (each) => agree(each, photo, index + 1));
});

/** Balls of other colours and sizes. */
async function madePhotos() {
  const made = [];
  for (const [name, hue, width, height] of [["orange.png", 28, 640, 480], ["blue.png", 210, 480, 640], ["green.jpg", 130, 600, 400]]) {
    const { buffer } = await ball(browser, { name, hue, width, height });
    made.push({ name, bytes: buffer, rect: BALL.map((part, side) => Math.round(part * (side % 2 ? height : width))) });
  }
  return made;
}

async function photosOf(folder) {
  const names = (await readdir(folder)).filter((name) => /\.(png|jpe?g)$/i.test(name)).sort();
  return Promise.all(names.map(async (name) => {
    const rect = (await readFile(join(folder, `${parse(name).name}.rect`), "utf8")).trim().split(/\s+/).map(Number);
    return { name, bytes: await readFile(join(folder, name)), rect };
  }));
}

async function agree(t, photo, object) {
  const folder = join(work, String(object));
  await mkdir(folder);
  const path = join(folder, photo.name);
  await writeFile(path, photo.bytes);

  const opened = await ask(page, "open_photo", { object, name: photo.name }, [photo.bytes]);
  const mask = (await ask(page, "mask", { object, rect: photo.rect, strokes: [] })).parts[0];
  const maskPath = join(folder, "mask.png");
  const theirs = redOf(await decoded(page, await maskOf(path, photo.rect, maskPath)));
  const share = differing(mask, theirs);
  t.diagnostic(`${photo.name}: ${opened.width} x ${opened.height}, ${(100 * share).toFixed(3)} % of the mask's pixels differ`);
  assert.ok(share <= (isJpeg(photo) ? JPEG_SHARE : 0), `${share} of the mask differs`);

  if (share === 0) await agreeOnLayers(t, object, path, maskPath, mask);
  await agreeOnPicture(t, object, join(folder, "scene"));
  await ask(page, "close", { object });
}

async function agreeOnLayers(t, object, path, maskPath, mask) {
  const { parts: [albedo, shading] } = await ask(page, "decompose", { object });
  const theirs = await decompositionOf(path, maskPath, join(parse(path).dir, "layers"));
  const far = {
    albedo: distance(albedo, await lightOf(theirs.albedo), mask, () => 1),
    shading: distance(shading, await lightOf(theirs.shading), mask, scaleOf),
  };
  t.diagnostic(`albedo differs by ${far.albedo.toFixed(4)}, shading by ${far.shading.toFixed(4)}`);
  assert.ok(far.albedo <= NEAR, `albedo differs by ${far.albedo}`);
  assert.ok(far.shading <= NEAR, `shading differs by ${far.shading}`);
}

async function agreeOnPicture(t, object, folder) {
  await ask(page, "background", { kind: "panorama_file", name: "room.hdr" }, [await readFile(join(FOLDER, "room.hdr"))]);
  const scene = sceneOf(object);
  const [png] = (await ask(page, "save", { scene, format: "png" })).parts;
  const [zip] = (await ask(page, "export", { scene, name: "scene" })).parts;
  const [ours, theirs] = [await decoded(page, png), await decoded(page, await pictureOf(zip, folder))];
  assert.deepEqual([ours.width, ours.height], [theirs.width, theirs.height]);
  const far = farthest(ours.rgba, theirs.rgba);
  t.diagnostic(`the relit picture differs by ${far} / 255`);
  assert.ok(far <= 1, `the relit picture differs by ${far} / 255`);
}

const sceneOf = (object) => ({
  size: [1280, 960], fov: 60, down: 10, match: true, white_balance: "light", exposure: 0,
  light: { angle: 40 },
  objects: [{ object, at: [0.55, 0.92], height: 0.5, rotation: 5, tint: [1, 0.9, 0.8], gloss: [0.3, 60], exposure: 0.2, shadow: 0.9 }],
});

const isJpeg = ({ name }) => /\.jpe?g$/i.test(name);

const redOf = ({ rgba }) => rgba.filter((_, index) => index % 4 === 0);

function differing(a, b) {
  if (a.length !== b.length) return 1;
  return a.reduce((count, value, index) => count + (value !== b[index]), 0) / a.length;
}

/** The light of a layer's file, by pixels of red, green, blue and alpha. */
async function lightOf({ png, white }) {
  return Float32Array.from((await decoded(page, png)).rgba, (value) => white * linear(value / 255));
}

/** The farthest distance on the object of sRGB values, 0 to 1; `scale` says by what the other's light is multiplied. */
function distance(ours, theirs, mask, scale) {
  assert.equal(ours.length, theirs.length, "layers of the same size");
  const factor = scale(ours, theirs, mask);
  let most = 0;
  for (let at = 0; at < ours.length; at++) {
    if (at % 4 === 3 || mask[at >> 2] < 128) continue;
    most = Math.max(most, Math.abs(ours[at] / 255 - encoded(Math.min(1, factor * theirs[at]))));
  }
  return most;
}

/** The page shows shading so bright that it is seen: the ratio of its light to the file's. */
function scaleOf(ours, theirs, mask) {
  const ratios = [];
  for (let at = 0; at < ours.length; at += 4) {
    if (mask[at >> 2] >= 128 && ours[at] > 100 && ours[at] < 250) ratios.push(linear(ours[at] / 255) / theirs[at]);
  }
  return ratios.sort((a, b) => a - b)[ratios.length >> 1];
}

const linear = (value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
const encoded = (light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
