// The line to the rig: its state as it changes, commands to it, and the news that the line is cut.

/** Milliseconds without a word after which the connection counts as lost; the rig speaks every 2 s. */
const SILENCE = 5000;
/** Milliseconds between two attempts to get the connection back. */
const AGAIN = 1000;

/** An answer other than the one hoped for; `status` is 0 where there was none at all. */
export class Problem extends Error {
  constructor(status, sentence) {
    super(sentence);
    this.status = status;
  }
}

/** Asks the rig; gives the response or throws a Problem. */
export async function request(path, { wait = 10_000, ...options } = {}) {
  let response;
  try {
    response = await fetch(path, { ...options, signal: AbortSignal.timeout(wait) });
  } catch {
    throw new Problem(0, "The rig does not answer. Is it on, and is this phone on the same network?");
  }
  if (response.ok) return response;
  const problem = await response.json().catch(() => ({}));
  throw new Problem(response.status, problem.error ?? `The rig answered with status ${response.status}.`);
}

/** Asks for JSON. */
export async function ask(path) {
  return (await request(path)).json();
}

/** Gives the rig a command and returns the state after it. */
export async function give(command) {
  const body = JSON.stringify(command);
  const headers = { "Content-Type": "application/json" };
  return (await request("/api/v1/command", { method: "POST", headers, body, wait: 20_000 })).json();
}

/** Keeps the page up to date: `on.state(state)`, `on.lost()`, `on.locked()`. */
export function follow(on) {
  let source, silence;
  const heard = () => {
    clearTimeout(silence);
    silence = setTimeout(again, SILENCE);
  };
  const again = () => {
    clearTimeout(silence);
    source.close();
    on.lost();
    setTimeout(begin, AGAIN);
  };
  const begin = async () => {
    try {
      await request("/api/v1/state", { wait: 4000 });
    } catch (problem) {
      if (problem.status === 401) return on.locked();
      on.lost();
      return setTimeout(begin, AGAIN);
    }
    source = new EventSource("/api/v1/events");
    source.addEventListener("state", (event) => {
      heard();
      on.state(JSON.parse(event.data));
    });
    source.addEventListener("beat", heard);
    source.addEventListener("error", again, { once: true });
    heard();
  };
  begin();
}
