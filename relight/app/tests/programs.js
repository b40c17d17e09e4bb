// The engine without its page, and the programs that it is held against, answering the same questions.

import { execFile } from "node:child_process";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { promisify } from "node:util";
import { inflateRawSync } from "node:zlib";

const run = promisify(execFile);

/** Starts an engine of the page in the page: `ask` asks it. */
export async function startEngine(page) {
  await page.evaluate(async () => {
    const { Engine, MODULE, NETWORKS } = await import("./engine.js");
    const { Loading } = await import("./loading.js");
    window.testedEngine = await Engine.start(new Loading(MODULE, NETWORKS));
  });
}

/** Asks the engine: { ...reply, parts: [Buffer] }. */
export async function ask(page, op, fields = {}, parts = []) {
  const question = { op, fields, parts: parts.map((part) => part.toString("base64")) };
  const { reply, texts } = await page.evaluate(askedThere, question);
  return { ...reply, parts: texts.map((text) => Buffer.from(text, "base64")) };
}

/** Runs in the page. */
async function askedThere({ op, fields, parts }) {
  const bytes = parts.map((text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
  const { parts: answered, ...reply } = await window.testedEngine.ask(op, fields, bytes);
  const texts = answered.map((part) => {
    let binary = "";
    for (let at = 0; at < part.length; at += 32768) binary += String.fromCharCode(...part.subarray(at, at + 32768));
    return btoa(binary);
  });
  return { reply, texts };
}

/** What `relit-mask` makes of a rectangle: a PNG. */
export async function maskOf(photo, rect, to) {
  await run(process.env.RELIT_MASK, [photo, "--rect", rect.join(","), "-o", to]);
  return readFile(to);
}

/** What `relight decompose` makes: { albedo, shading } as PNG files, each with the light that its white stands for. */
export async function decompositionOf(photo, mask, to) {
  await run(process.env.RELIGHT, ["decompose", photo, "--mask", mask, "-o", to]);
  const { white } = JSON.parse(await readFile(join(to, "decomposition.json"), "utf8"));
  const layer = async (name) => ({ png: await readFile(join(to, `${name}.png`)), white: white[name] });
  return { albedo: await layer("albedo"), shading: await layer("shading") };
}

/** What `relight insert` makes of a kept scene: a PNG. */
export async function pictureOf(zip, folder) {
  await unzip(zip, folder);
  const to = join(folder, "out.png");
  await run(process.env.RELIGHT, ["insert", "--scene", join(folder, "scene.toml"), "-o", to]);
  return readFile(to);
}

/** Unpacks a zip by the list at its end. */
export async function unzip(bytes, folder) {
  const end = bytes.lastIndexOf(Buffer.from("PK\x05\x06", "latin1"));
  let at = bytes.readUInt32LE(end + 16);
  for (let left = bytes.readUInt16LE(end + 10); left > 0; left--) {
    const [packing, size] = [bytes.readUInt16LE(at + 10), bytes.readUInt32LE(at + 20)];
    const [name, extra, comment] = [28, 30, 32].map((field) => bytes.readUInt16LE(at + field));
    const local = bytes.readUInt32LE(at + 42);
    const from = local + 30 + bytes.readUInt16LE(local + 26) + bytes.readUInt16LE(local + 28);
    const packed = bytes.subarray(from, from + size);
    const path = join(folder, bytes.toString("utf8", at + 46, at + 46 + name));
    await mkdir(dirname(path), { recursive: true });
    await writeFile(path, packing === 0 ? packed : inflateRawSync(packed));
    at += 46 + name + extra + comment;
  }
}
