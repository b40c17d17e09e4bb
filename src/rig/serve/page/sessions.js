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
  if (session.rating) parts.push("★".repeat(session.rating));
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
  $("player-tar").href = `${path(session.id)}.tar`;
  const day = /^\d{8}(?=T)/.exec(session.id)?.[0];
  $("player-day").hidden = !day;
  $("player-day").href = `/api/v1/sessions.tar?day=${day}`;
  showRemarks(session);
  outline.hidden = true;
  $("player-outline").textContent = "";
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
    showMask(mine, detail.has_mask);
  } catch (problem) {
    $("player-error").textContent = problem.message;
  }
}

const outline = $("player-mask");

/** Draws the mask's outline over the frames, or says how to make a mask. */
async function showMask(mine, has) {
  if (!has) {
    const folder = [root, mine.id].filter(Boolean).join("/");
    $("player-outline").replaceChildren("No mask yet: ", make("code", { text: `relit-mask ${folder} --rect X,Y,W,H` }));
    return;
  }
  const response = await request(`${path(mine.id)}/mask.png`);
  const mask = await createImageBitmap(await response.blob());
  if (shown !== mine) return mask.close();
  const { width, height } = mask;
  Object.assign(outline, { width, height });
  const context = outline.getContext("2d", { willReadFrequently: true });
  context.drawImage(mask, 0, 0);
  mask.close();
  const image = context.getImageData(0, 0, width, height);
  const inside = Uint8Array.from({ length: width * height }, (_, at) => image.data[at * 4] > 127);
  const pixels = new Uint32Array(image.data.buffer).fill(0);
  // As wide as it can be seen in a picture of this size.
  const wide = Math.max(1, Math.round(width / 320));
  for (let y = 0, at = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1, at += 1) {
      const out = (dx, dy) => x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height || !inside[at + dx + dy * width];
      if (inside[at] && (out(wide, 0) || out(-wide, 0) || out(0, wide) || out(0, -wide))) pixels[at] = 0xff5aa6f2;
    }
  }
  context.putImageData(image, 0, 0);
  outline.hidden = false;
  $("player-outline").textContent = "The line is the mask's outline.";
}

let root = "";

/** The folder of sessions on the rig's computer, for the commands that are shown. */
export function showRoot(folder) {
  root = folder;
}

let remarks = { session: null, rating: null };

function showRemarks(session) {
  remarks = { session, rating: session.rating };
  $("note").value = session.note ?? "";
  showStars();
}

function showStars() {
  const star = (n) => {
    const on = n <= (remarks.rating ?? 0);
    const button = make("button", { type: "button", text: on ? "★" : "☆", ariaLabel: `${n} of 5` });
    button.addEventListener("click", () => {
      remarks.rating = remarks.rating === n ? null : n;
      showStars();
    });
    return button;
  };
  $("stars").replaceChildren(...[1, 2, 3, 4, 5].map(star));
}

const changed = () => document.dispatchEvent(new Event("sessions-changed"));

async function saveRemarks() {
  const body = JSON.stringify({ note: $("note").value.trim() || null, rating: remarks.rating });
  const headers = { "Content-Type": "application/json" };
  try {
    await request(`${path(remarks.session.id)}/remarks`, { method: "PUT", headers, body });
    player.close();
    changed();
  } catch (problem) {
    $("player-error").textContent = problem.message;
  }
}

/** Puts the session away; it can be had back until the page is left, and from the trash folder after that. */
async function putAway() {
  const { session } = remarks;
  try {
    await request(path(session.id), { method: "DELETE" });
  } catch (problem) {
    $("player-error").textContent = problem.message;
    return;
  }
  player.close();
  changed();
  $("undo-text").textContent = `${session.object} is in the trash folder.`;
  $("undo").hidden = false;
  $("undo-button").onclick = async () => {
    try {
      await request(`${path(session.id)}/restore`, { method: "POST" });
      $("undo").hidden = true;
      changed();
    } catch (problem) {
      $("undo-text").textContent = problem.message;
    }
  };
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
$("remarks").addEventListener("submit", (event) => {
  event.preventDefault();
  saveRemarks();
});
$("put-away").addEventListener("click", putAway);
player.addEventListener("close", () => {
  running(false);
  shown = null;
});
