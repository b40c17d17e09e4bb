// The engine in its worker. The page sends a compiled module first, then requests, which are answered one after another.

import { lengthOf, pack, unpack } from "./message.js";

const WORD = 4;
let exports = null;
let last = Promise.resolve();

self.addEventListener("message", ({ data }) => {
  last = last.then(() => (data.module ? begin(data.module) : answer(data)));
});

async function begin(module) {
  try {
    exports = (await WebAssembly.instantiate(module, importsOf(module))).exports;
    self.postMessage({ ready: true });
  } catch (error) {
    self.postMessage({ broken: error.message });
  }
}

/** A function for every import of the module; none should be called, and each throws. */
function importsOf(module) {
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) {
    imports[from] ??= {};
    imports[from][name] ??= () => {
      throw new Error(`the engine asked for ${name}, which the page does not have`);
    };
  }
  return imports;
}

async function answer({ id, fields, parts }) {
  let bytes;
  try {
    bytes = await Promise.all(parts.map(bytesOf));
  } catch {
    return self.postMessage({ id, reply: { error: "The file can no longer be read: choose it again." }, parts: [] });
  }
  try {
    const [text, ...rest] = ask([new TextEncoder().encode(JSON.stringify(fields)), ...bytes]);
    const reply = JSON.parse(new TextDecoder().decode(text));
    const memory = exports.memory.buffer.byteLength;
    self.postMessage({ id, reply, parts: rest, memory }, rest.map((part) => part.buffer));
  } catch (error) {
    self.postMessage({ id, fault: faultOr(error.message) });
  }
}

/** Files come as blobs, and are read here, where they are needed. */
async function bytesOf(part) {
  return part instanceof Blob ? new Uint8Array(await part.arrayBuffer()) : part;
}

function ask(parts) {
  const length = lengthOf(parts);
  const request = exports.relight_alloc(length) >>> 0;
  pack(parts, new Uint8Array(exports.memory.buffer, request, length));
  return take(exports.relight_answer(request, length) >>> 0);
}

/** The parts of a reply, whose memory is freed. */
function take(address) {
  const bytes = replyAt(address);
  const parts = unpack(bytes);
  exports.relight_free(address, WORD + bytes.length);
  return parts;
}

function replyAt(address) {
  const { buffer } = exports.memory;
  return new Uint8Array(buffer, address + WORD, new DataView(buffer).getUint32(address, true));
}

/** The engine's own message on its crash, else the browser's. */
function faultOr(text) {
  try {
    return new TextDecoder().decode(replyAt(exports.relight_fault() >>> 0).slice()) || text;
  } catch {
    return text;
  }
}
