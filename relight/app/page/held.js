// The engine's contents, as the requests that made them: files, strokes, the background. A new engine gets them again.

/** The key of a request, if it changes the engine's contents. */
const KEYS = {
  open_photo: ({ object }) => `object ${object}`,
  open_pixels: ({ object }) => `object ${object}`,
  mask: ({ object }) => `mask ${object}`,
  background: () => "background",
};

export class Held {
  #requests = new Map();

  /** Keeps an answered request, if it changed the engine's contents. */
  note(request) {
    const { op, object } = request.fields;
    if (op === "close") {
      this.#requests.delete(`object ${object}`);
      this.#requests.delete(`mask ${object}`);
    }
    const key = KEYS[op]?.(request.fields);
    if (key) this.#requests.set(key, request);
  }

  /** All requests, in their first order. */
  requests() {
    return [...this.#requests.values()];
  }

  /** Drops a request; returns the name of what is lost. */
  drop({ fields }) {
    this.#requests.delete(KEYS[fields.op](fields));
    if (fields.object !== undefined) this.#requests.delete(`mask ${fields.object}`);
    return fields.name ?? fields.op;
  }
}
