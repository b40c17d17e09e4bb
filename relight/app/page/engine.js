// The engine as the page sees it: requests and answers. After a crash it is restarted and gets its contents again.

import { Held } from "./held.js";

/** The smallest module that needs SIMD. */
const SIMD = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];
const NO_WASM = "This browser cannot run relight: it lacks WebAssembly with SIMD. Use a browser from 2023 or later.";

/** The engine, and the weights of its networks. */
export const MODULE = "relight.wasm";
export const NETWORKS = "weights.safetensors";

/** Requests after which the networks will be needed. */
const NEED_NETWORKS = new Set(["open_photo", "open_pixels"]);

/** The engine crashed during a request. */
export class Fault extends Error {}

/** Events: "restart" (detail: a sentence), "busy" (detail: the number of open requests). */
export class Engine extends EventTarget {
  /** The engine's memory after its last answer, bytes. */
  memory = 0;

  #module;
  #loading;
  /** The file of the networks, once loaded, and its transfer into the engine, once they are needed. */
  #networks = null;
  #prepared = null;
  #worker;
  #held = new Held();
  #open = new Map();
  #number = 0;
  #restarting = null;

  /** Loads the engine, without its networks. */
  static async start(loading) {
    if (!canRun()) throw new Error(NO_WASM);
    const engine = new Engine();
    engine.#loading = loading;
    await loading.file("The engine", MODULE, async (file) => {
      engine.#module = await compiled(file);
      await engine.#begin();
    });
    return engine;
  }

  /** Loads the networks, once. */
  prepare() {
    this.#prepared ??= this.#loading.file("The networks", NETWORKS, async (file) => {
      await this.#load(file);
      this.#networks = file;
    });
    return this.#prepared;
  }

  /** Sends a request. The answer has its `parts` and the `seconds` it took; refusals and crashes are thrown as errors with a sentence. */
  async ask(op, fields = {}, parts = []) {
    if (this.#restarting) await this.#restarting;
    if (NEED_NETWORKS.has(op)) await this.prepare();
    const request = { fields: { op, ...fields }, parts };
    const answer = await this.#send(request);
    this.#held.note(request);
    return answer;
  }

  async #begin() {
    this.#worker = new Worker("worker.js", { type: "module" });
    await new Promise((resolve, reject) => {
      this.#worker.onmessage = ({ data }) => (data.ready ? resolve() : reject(new Error(`it does not start (${data.broken}).`)));
      this.#worker.onerror = () => reject(new Error("its worker does not start."));
      this.#worker.postMessage({ module: this.#module });
    });
    this.#worker.onmessage = ({ data }) => this.#answered(data);
    this.#worker.onerror = (event) => this.#failed(event);
  }

  #load(file) {
    return this.#send({ fields: { op: "load" }, parts: [file] });
  }

  #send(request) {
    const id = ++this.#number;
    return new Promise((resolve, reject) => {
      this.#open.set(id, { request, resolve, reject, began: performance.now() });
      this.#worker.postMessage({ id, ...request });
      this.#tellBusy();
    });
  }

  #answered({ id, reply, parts, fault, memory }) {
    const { request, resolve, reject, began } = this.#open.get(id);
    this.#open.delete(id);
    this.#tellBusy();
    const end = performance.now();
    performance.measure(`relight:${request.fields.op}`, { start: began, end });
    if (fault !== undefined) {
      this.#restart(fault);
      return reject(new Fault(`The engine crashed (${fault}).`));
    }
    this.memory = memory ?? this.memory;
    if (reply.error) return reject(new Error(reply.error));
    resolve({ ...reply, parts, seconds: (end - began) / 1000 });
  }

  /** The worker itself failed: open requests get no answer. */
  #failed(event) {
    event.preventDefault();
    const open = [...this.#open.values()];
    this.#open.clear();
    this.#restart(event.message);
    for (const { reject } of open) reject(new Fault("The engine crashed."));
  }

  #restart(fault) {
    if (this.#restarting) return;
    this.#restarting = this.#rebuild()
      .then((lost) => {
        const loss = lost.length > 0 ? ` These could not be opened again: ${lost.join(", ")}.` : "";
        this.dispatchEvent(new CustomEvent("restart", { detail: `The engine crashed and was started again (${fault}).${loss}` }));
      })
      .catch((error) => this.dispatchEvent(new CustomEvent("restart", { detail: `The engine could not be restarted: ${error.message} Reload the page.` })))
      .finally(() => (this.#restarting = null));
  }

  /** Starts a new worker with the contents of the old one; returns the names of what it refused. */
  async #rebuild() {
    const waiting = [...this.#open.values()];
    const lost = [];
    for (;;) {
      this.#open.clear();
      this.#worker.terminate();
      await this.#begin();
      if (this.#networks) await this.#load(this.#networks);
      const bad = await this.#giveAgain();
      if (!bad) break;
      lost.push(this.#held.drop(bad));
    }
    for (const { request, resolve, reject } of waiting) this.#send(request).then(resolve, reject);
    return lost;
  }

  /** Repeats the requests; returns the first that fails again, if any. */
  async #giveAgain() {
    for (const request of this.#held.requests()) {
      try {
        await this.#send(request);
      } catch {
        return request;
      }
    }
    return null;
  }

  #tellBusy() {
    this.dispatchEvent(new CustomEvent("busy", { detail: this.#open.size }));
  }
}

function canRun() {
  return typeof WebAssembly === "object" && WebAssembly.validate(new Uint8Array(SIMD)) && typeof Worker === "function";
}

async function compiled(file) {
  try {
    return await WebAssembly.compile(await file.arrayBuffer());
  } catch (error) {
    throw new Error(`the file is damaged, or this browser cannot run it (${error.message}).`);
  }
}
