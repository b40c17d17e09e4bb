// Loads what the page needs before it works, with a progress bar in bytes. Failures are shown, and "Try again" repeats them.

import { $ } from "./dom.js";

/** The files of the page with their bytes. */
const LIST = "files.json";

export class Loading {
  #names;
  /** Bytes of each file, and how many have arrived. */
  #sizes = null;
  #here = new Map();
  /** The files that are in use. */
  #used = new Set();

  /** Will load these files. */
  constructor(...names) {
    this.#names = names;
  }

  /** Loads a file and passes it to `use`, until that succeeds. `what` is its name in messages. */
  async file(what, name, use) {
    for (let cache = "default"; ; cache = "reload") {
      try {
        this.#sizes ??= await this.#list(cache);
        await use(await this.#download(what, name, cache));
        return this.#done(name);
      } catch (error) {
        await askAgain(`${what} could not be loaded: ${error.message}`);
      }
    }
  }

  async #list(cache) {
    const { files } = await (await get(LIST, cache)).json().catch(() => {
      throw new Error(`${LIST} is damaged.`);
    });
    return Object.fromEntries(this.#names.map((name) => [name, files[name] ?? 0]));
  }

  async #download(what, name, cache) {
    const reader = (await get(name, cache)).body.getReader();
    const chunks = [];
    let bytes = 0;
    const show = () => {
      this.#here.set(name, bytes);
      this.#show(what);
    };
    show();
    for (let part = await next(reader); !part.done; part = await next(reader)) {
      chunks.push(part.value);
      bytes += part.value.length;
      show();
    }
    return new Blob(chunks);
  }

  #show(what) {
    const all = sum(Object.values(this.#sizes));
    const here = Math.min(all, sum(this.#here.values()));
    $("loading-text").textContent = `Loading: ${what.toLowerCase()}, ${megabytes(here)} of ${megabytes(all)} MB`;
    $("loading-bar").max = all;
    $("loading-bar").value = here;
  }

  /** Between two files the bar rests. */
  #done(name) {
    this.#here.set(name, this.#sizes[name]);
    this.#used.add(name);
    $("loading").hidden = this.#used.size === this.#names.length;
  }
}

/** Shows what failed; resolves on "Try again". */
async function askAgain(fault) {
  sayFault(fault);
  $("loading-again").hidden = false;
  await new Promise((resolve) => $("loading-again").addEventListener("click", resolve, { once: true }));
  $("loading-again").hidden = true;
  sayFault("");
}

/** Shows why the page does not start. */
export function sayFault(fault) {
  $("loading").hidden = false;
  $("loading-fault").textContent = fault;
  $("loading-progress").hidden = fault !== "";
}

async function get(name, cache) {
  const response = await fetch(name, { cache }).catch(() => null);
  if (!response) throw new Error("the server does not answer.");
  if (!response.ok) throw new Error(`the server has no ${name} (it answers ${response.status}).`);
  return response;
}

async function next(reader) {
  return reader.read().catch(() => {
    throw new Error("the connection was lost.");
  });
}

const sum = (numbers) => [...numbers].reduce((sum, number) => sum + number, 0);

const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
