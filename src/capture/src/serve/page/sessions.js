// The list of what was recorded, and the player that scrubs through a turn.
import { make } from "./elements.js";
import { ask, request } from "./link.js";
import { describe, hideSteps, showSteps, standing } from "./process.js";

/** Sessions that are fetched at a time. */
const PART = 20;
/** Milliseconds between frames in play; the turn's own pace would need every frame in time. */
const PLAY = 100;

const $ = (id) => document.getElementById(id);
const path = (id) => `/api/v1/sessions/${encodeURIComponent(id)}`;

/** A session's verdict in words, and its class. */
function verdict(session) {
  const dropped = session.dropped ?? 0;
  if (session.status === "recording") return ["recording", ""];
  if (session.status === "unreadable") return ["unreadable", "bad"];
  // What ended a take early is past: only its data is incomplete.
  if (session.status === "aborted") return ["aborted", "warn"];
  if (dropped > 0) return [`${dropped} frames dropped`, "warn"];
  return session.notes.length > 0 ? ["clean, but see below", "warn"] : ["clean", "good"];
}

/** Why a session is not whole, or what else to know of it. */
const remarkOn = (session) => session.reason ?? session.notes.join("; ");

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
  const [stage, stageClass] = standing(session);
  const text = make(
    "span",
    {},
    make("b", { text: session.object }),
    make("small", { text: when(session) }),
    make("small", {}, make("span", { text: words, className }), make("span", { text: facts(session) && ` · ${facts(session)}` })),
    make("small", { className: `reason ${session.reason ? "" : "warn"}`, text: remarkOn(session) }),
    make("small", { className: `standing ${stageClass}`, text: stage }),
  );
  const button = make("button", { type: "button", disabled: !ended }, image, text);
  button.addEventListener("click", () => play(session));
  return make("li", {}, button);
}

const dayOf = ({ id }) => /^\d{8}(?=T)/.exec(id)?.[0] ?? "";

/** The heading of a day: how many sessions there are, and how far they have come. */
function heading(day, sessions) {
  const date = day && new Date(`${day.slice(0, 4)}-${day.slice(4, 6)}-${day.slice(6)}T12:00Z`).toLocaleDateString([], { dateStyle: "medium", timeZone: "UTC" });
  const stages = ["recorded", "masked", "checked", "extracted"];
  const reached = (at) => sessions.filter(({ results }) => stages.indexOf(results?.stage) >= at).length;
  const doubtful = sessions.filter(({ results }) => results?.is_doubtful).length;
  const counts = [`${sessions.length} recorded`, `${reached(1)} masked`, `${reached(3)} extracted`];
  if (doubtful) counts.push(`${doubtful} to look at`);
  return make("li", { className: "day" }, make("b", { text: date || "Other names" }), make("small", { text: counts.join(" · ") }));
}

/** The sessions that are shown, newest first. */
let listed = [];

function showList() {
  const days = Map.groupBy ? [...Map.groupBy(listed, dayOf)] : grouped();
  $("sessions").replaceChildren(...days.flatMap(([day, sessions]) => [heading(day, sessions), ...sessions.map(entry)]));
  $("no-sessions").hidden = listed.length > 0;
}

function grouped() {
  const days = new Map();
  for (const session of listed) days.set(dayOf(session), [...(days.get(dayOf(session)) ?? []), session]);
  return [...days];
}

/** The session of this name, where the list has it. */
export const listedSession = (id) => listed.find((session) => session.id === id);

/** Fills the list again, or with `before` continues with older sessions; gives the names of the objects in it. */
export async function listSessions(before) {
  const query = before ? `&before=${encodeURIComponent(before)}` : "";
  const sessions = await ask(`/api/v1/sessions?limit=${PART}${query}`);
  listed = before ? [...listed, ...sessions] : sessions;
  showList();
  $("more").hidden = sessions.length < PART;
  $("more").onclick = () => listSessions(sessions.at(-1).id).catch(() => {});
  if (!before) await listTrash();
  return [...new Set(listed.map(({ object }) => object))];
}

/** What was put away, each with the way back. */
async function listTrash() {
  const sessions = await ask("/api/v1/trash");
  $("trash-card").hidden = sessions.length === 0;
  $("trash-title").textContent = `Trash (${sessions.length})`;
  const lines = sessions.slice(0, PART).map((session) => {
    const back = make("button", { type: "button", text: "Restore", ariaLabel: `Restore ${session.object}` });
    back.addEventListener("click", async () => {
      back.disabled = true;
      try {
        await request(`${path(session.id)}/restore`, { method: "POST" });
        changed();
      } catch (problem) {
        back.replaceWith(make("span", { className: "bad", text: problem.message }));
      }
    });
    return make("li", {}, make("span", {}, make("b", { text: session.object }), make("small", { text: when(session) })), back);
  });
  $("trash").replaceChildren(...lines);
}

/** The states of jobs changed: the list says so without being fetched. */
export const refreshStages = showList;

const player = $("player");
const slider = $("player-slider");
let shown = null;
let timer = null;

/** Opens a session by its name, such as after its mask was edited. */
export async function openSession(id) {
  play(await describe(id));
}

async function play(session) {
  inTrash(false);
  $("player-title").textContent = session.object;
  $("player-when").textContent = when(session);
  $("player-video").href = `${path(session.id)}/video`;
  $("player-tar").href = `${path(session.id)}.tar`;
  showRemarks(session);
  outline.hidden = true;
  $("player-outline").textContent = "";
  const [words, className] = verdict(session);
  Object.assign($("player-verdict"), { textContent: `${words} · ${facts(session)}`, className });
  Object.assign($("player-reason"), { textContent: remarkOn(session), className: session.reason ? "quiet" : "warn" });
  $("player-notes").replaceChildren();
  $("player-error").textContent = "";
  $("player-frame").removeAttribute("src");
  slider.max = Math.max((session.frames ?? 1) - 1, 0);
  slider.value = 0;
  shown = { id: session.id, times: [], angles: [], fetching: false, wanted: 0 };
  player.showModal();
  seek(0);
  try {
    const mine = shown;
    const detail = await describe(session.id);
    if (shown !== mine) return;
    // Another page may have saved remarks since the list was made.
    if (written() === remarks.saved && document.activeElement !== $("note")) showRemarks(detail);
    showSteps(detail, complain);
    Object.assign(shown, { times: detail.times_s, angles: detail.angles_deg });
    // What concerns the whole take stands below the verdict.
    const faults = detail.manifest.faults.filter(({ what }) => !detail.notes.includes(what));
    $("player-notes").replaceChildren(...faults.map(({ what }) => make("li", { text: what })));
    place();
    showMask(mine, detail.has_mask);
  } catch (problem) {
    $("player-error").textContent = problem.message;
  }
}

const complain = (sentence) => ($("player-error").textContent = sentence);

/** A job of the session that is shown has ended: its mask and results are other ones. */
export async function sessionChanged(ids) {
  const mine = shown;
  if (!mine || !ids.includes(mine.id)) return;
  try {
    const detail = await describe(mine.id);
    if (shown !== mine) return;
    showSteps(detail, complain);
    showMask(mine, detail.has_mask);
  } catch (problem) {
    complain(problem.message);
  }
}

const outline = $("player-mask");

/** Draws the mask's outline over the frames. */
async function showMask(mine, has) {
  outline.hidden = true;
  $("player-outline").textContent = "";
  if (!has) return;
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

/** The session whose remarks are shown, its stars, and the remarks as they were saved, and as they could not be. */
let remarks = { session: null, rating: null, saved: "", refused: "" };

/** Note and stars as they are shown, for the rig. */
const written = () => JSON.stringify({ note: $("note").value.trim() || null, rating: remarks.rating });

function showRemarks(session) {
  $("note").value = session.note ?? "";
  remarks = { session, rating: session.rating, refused: "" };
  remarks.saved = written();
  $("saved").textContent = "";
  showStars();
}

function showStars() {
  const star = (n) => {
    const on = n <= (remarks.rating ?? 0);
    const button = make("button", { type: "button", text: on ? "★" : "☆", ariaLabel: `${n} of 5` });
    button.addEventListener("click", () => {
      remarks.rating = remarks.rating === n ? null : n;
      showStars();
      saveRemarks();
    });
    return button;
  };
  $("stars").replaceChildren(...[1, 2, 3, 4, 5].map(star));
}

const changed = () => document.dispatchEvent(new Event("sessions-changed"));

/** Of several savings one follows the other. */
let saving = Promise.resolve(true);

/** Saves note and stars where they are new; gives whether all is saved. */
function saveRemarks() {
  const mine = remarks;
  const body = written();
  saving = saving.then(async () => {
    if (body === mine.saved) return true;
    const headers = { "Content-Type": "application/json" };
    try {
      await request(`${path(mine.session.id)}/remarks`, { method: "PUT", headers, body });
      Object.assign(mine, { saved: body, refused: "" });
      if (remarks === mine) $("saved").textContent = "Saved";
      changed();
      return true;
    } catch (problem) {
      mine.refused = body;
      if (remarks === mine) $("saved").textContent = "Not saved";
      complain(`Note and stars are not saved: ${problem.message}`);
      return false;
    }
  });
  return saving;
}

/** Closes the player once note and stars are saved; where they cannot be, the second time. */
async function leave() {
  const isGivenUp = player.classList.contains("trashed") || written() === remarks.refused;
  if (isGivenUp || (await saveRemarks())) player.close();
}

/** While the session that is shown is in the trash, the one thing to do is to have it back, by the same button. */
function inTrash(is) {
  player.classList.toggle("trashed", is);
  $("put-away").textContent = is ? "Undo" : "Delete";
  $("trashed").hidden = !is;
  const isExtracted = !$("player-shard").hidden;
  $("trashed").textContent = isExtracted ? "In the trash. Its samples stay in the data set." : "In the trash";
  $("saved").hidden = is;
}

/** Puts the session away, or has it back. */
async function putAway() {
  const { session } = remarks;
  const back = player.classList.contains("trashed");
  $("put-away").disabled = true;
  if (!back) await saveRemarks();
  try {
    if (back) await request(`${path(session.id)}/restore`, { method: "POST" });
    else await request(path(session.id), { method: "DELETE", wait: 20_000 });
    inTrash(!back);
    complain("");
    changed();
    if (back && shown) showSteps(await describe(session.id), complain);
  } catch (problem) {
    complain(problem.message);
  }
  $("put-away").disabled = false;
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
$("player-close").addEventListener("click", leave);
player.addEventListener("cancel", (event) => {
  event.preventDefault();
  leave();
});
$("note").addEventListener("input", () => ($("saved").textContent = ""));
$("note").addEventListener("change", saveRemarks);
$("remarks").addEventListener("submit", (event) => event.preventDefault());
$("put-away").addEventListener("click", putAway);
player.addEventListener("close", () => {
  running(false);
  shown = null;
  hideSteps();
});
