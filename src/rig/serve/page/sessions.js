// The list of what was recorded, and the player that scrubs through a turn.
import { ask, request } from "./link.js";

/** Sessions that are fetched at a time. */
const PART = 20;
/** Milliseconds between frames in play; the turn's own pace would need every frame in time. */
const PLAY = 100;

const $ = (id) => document.getElementById(id);
const path = (id) => `/api/v1/sessions/${encodeURIComponent(id)}`;

/** An element with text, class and children. */
export function make(tag, { text, ...rest } = {}, ...children) {
  const element = Object.assign(document.createElement(tag), rest);
  if (text !== undefined) element.textContent = text;
  element.append(...children);
  return element;
}

/** A session's verdict in words, and its class. */
function verdict(session) {
  const dropped = session.dropped ?? 0;
  if (session.status === "recording") return ["being recorded", ""];
  if (session.status === "unreadable") return ["unreadable", "bad"];
  if (session.status === "aborted") return ["aborted", "bad"];
  return dropped > 0 ? [`${dropped} dropped`, "bad"] : ["clean", "good"];
}

function facts(session) {
  const parts = [];
  if (session.frames !== null) parts.push(`${session.frames} frames`);
  if (session.duration_s !== null) parts.push(`${session.duration_s.toFixed(1)} s`);
  return parts.join(" · ");
}

const when = (session) =>
  session.created ? new Date(session.created).toLocaleString([], { dateStyle: "medium", timeStyle: "short" }) : session.id;

function entry(session) {
  const ended = session.status === "complete" || session.status === "aborted";
  const src = `${path(session.id)}/thumbnail.jpg`;
  const image = ended ? make("img", { src, alt: "", loading: "lazy" }) : make("span", { className: "none" });
  image.addEventListener("error", () => image.replaceWith(make("span", { className: "none" })));
  const [words, className] = verdict(session);
  const text = make(
    "span",
    {},
    make("b", { text: session.object }),
    make("small", { text: when(session) }),
    make("small", {}, make("span", { text: words, className }), make("span", { text: facts(session) && ` · ${facts(session)}` })),
  );
  const button = make("button", { type: "button", disabled: !ended }, image, text);
  button.addEventListener("click", () => play(session));
  return make("li", {}, button);
}

/** Fills the list anew, or with `before` goes on with older ones. */
export async function listSessions(before) {
  const query = before ? `&before=${encodeURIComponent(before)}` : "";
  const sessions = await ask(`/api/v1/sessions?limit=${PART}${query}`);
  const entries = sessions.map(entry);
  if (before) $("sessions").append(...entries);
  else $("sessions").replaceChildren(...entries);
  $("no-sessions").hidden = $("sessions").childElementCount > 0;
  $("more").hidden = sessions.length < PART;
  $("more").onclick = () => listSessions(sessions.at(-1).id).catch(() => {});
}

const player = $("player");
const slider = $("player-slider");
let shown = null;
let timer = null;

async function play(session) {
  $("player-title").textContent = session.object;
  $("player-when").textContent = when(session);
  $("player-video").href = `${path(session.id)}/video`;
  const [words, className] = verdict(session);
  Object.assign($("player-verdict"), { textContent: `${words} · ${facts(session)}`, className });
  $("player-notes").replaceChildren(...(session.reason ? [make("li", { text: session.reason })] : []));
  $("player-error").textContent = "";
  $("player-frame").removeAttribute("src");
  slider.max = Math.max((session.frames ?? 1) - 1, 0);
  slider.value = 0;
  shown = { id: session.id, times: [], angles: [], fetching: false, wanted: 0 };
  player.showModal();
  seek(0);
  try {
    const mine = shown;
    const detail = await ask(path(session.id));
    if (shown !== mine) return;
    Object.assign(shown, { times: detail.times_s, angles: detail.angles_deg });
    const gaps = detail.gaps.map(({ before, missing }) => `${missing} dropped before frame ${before}`);
    const faults = detail.manifest.faults.map(({ what }) => what);
    $("player-notes").append(...[...gaps, ...faults].map((text) => make("li", { text })));
    place();
  } catch (problem) {
    $("player-error").textContent = problem.message;
  }
}

function place() {
  const n = Number(slider.value);
  const [time, angle] = [shown.times[n], shown.angles[n]];
  const parts = [`frame ${n}`];
  if (time !== undefined) parts.push(`${time.toFixed(2)} s`);
  if (angle !== undefined && angle !== null) parts.push(`${angle.toFixed(1)}°`);
  $("player-place").textContent = parts.join(" · ");
  slider.setAttribute("aria-valuetext", $("player-place").textContent);
}

/** Shows a frame. One is fetched at a time; what was passed over meanwhile is not. */
async function seek(n) {
  slider.value = n;
  place();
  const mine = shown;
  mine.wanted = Number(slider.value);
  if (mine.fetching) return;
  mine.fetching = true;
  while (shown === mine) {
    const now = mine.wanted;
    try {
      const response = await request(`${path(mine.id)}/frames/${now}.jpg`, { wait: 30_000 });
      const url = URL.createObjectURL(await response.blob());
      if (shown === mine) {
        URL.revokeObjectURL($("player-frame").src);
        $("player-frame").src = url;
        $("player-frame").alt = `Frame ${now}`;
        $("player-error").textContent = "";
      } else URL.revokeObjectURL(url);
    } catch (problem) {
      $("player-error").textContent = problem.message;
    }
    if (mine.wanted === now) break;
  }
  mine.fetching = false;
}

function running(on) {
  clearInterval(timer);
  timer = null;
  $("player-play").setAttribute("aria-pressed", on);
  $("player-play").textContent = on ? "Pause" : "Play";
  if (!on) return;
  // At most some 150 steps a turn: a turn takes 15 s to look through.
  const step = Math.max(1, Math.round(slider.max / 150));
  timer = setInterval(() => {
    if (shown.fetching) return;
    const next = Number(slider.value) + step;
    seek(next > Number(slider.max) ? 0 : next);
  }, PLAY);
}

slider.addEventListener("input", () => seek(slider.value));
$("player-back").addEventListener("click", () => seek(Math.max(Number(slider.value) - 1, 0)));
$("player-on").addEventListener("click", () => seek(Number(slider.value) + 1));
$("player-play").addEventListener("click", () => running(timer === null));
$("player-close").addEventListener("click", () => player.close());
player.addEventListener("close", () => {
  running(false);
  shown = null;
});
