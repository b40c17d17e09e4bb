// What the engine holds, as the requests that gave it: files, strokes, the background. A new engine is given them again.

/** The key under which a request is kept, for those that leave something in the engine. */
const KEYS = {
  open_photo: ({ object }) => `object ${object}`,
  open_pixels: ({ object }) => `object ${object}`,
  mask: ({ object }) => `mask ${object}`,
  background: () => "background",
  import: () => "import",
};

export class Held {
  #requests = new Map();

  /** Keeps a request that was answered, as far as it changed what the engine holds. */
  note(request) {
    const { op, object } = request.fields;
    if (op === "import") this.#requests.clear();
    if (op === "close") {
      this.#requests.delete(`object ${object}`);
      this.#requests.delete(`mask ${object}`);
    }
    const key = KEYS[op]?.(request.fields);
    if (key) this.#requests.set(key, request);
  }

  /** All requests, in the order in which they were first made. */
  requests() {
    return [...this.#requests.values()];
  }

  /** Gives a request up; the name of what is lost. */
  drop({ fields }) {
    this.#requests.delete(KEYS[fields.op](fields));
    if (fields.object !== undefined) this.#requests.delete(`mask ${fields.object}`);
    return fields.name ?? fields.op;
  }
}
