// The page: starts the engine and brings its parts together.

import { $, make } from "./dom.js";
import { Backgrounds, BUNDLED } from "./backgrounds.js";
import { bindControls } from "./controls.js";
import { Cutter } from "./cutter.js";
import { Engine, MODULE, NETWORKS } from "./engine.js";
import * as fields from "./fields.js";
import { Lamp } from "./lamp.js";
import { Library } from "./library.js";
import { Loading, sayFault } from "./loading.js";
import * as notices from "./notices.js";
import { Objects } from "./objects.js";
import { keepOffline } from "./offline.js";
import { painterOn } from "./painter.js";
import { Rendering } from "./rendering.js";
import { Saving } from "./saving.js";
import { emptyScene } from "./scene.js";
import { Stage } from "./stage.js";
import { bindTabs } from "./tabs.js";
import { Video } from "./video.js";
import { Work } from "./work.js";

/** Requests that take longer show activity, milliseconds. */
const LONG = 300;

notices.listen();
fields.listen();
bindTabs();
begin().catch((error) => {
  document.body.classList.add("dead");
  sayFault(error.message);
  return fields.refuseFiles(error.message);
});

async function begin() {
  const loading = new Loading(MODULE, ...Object.keys(BUNDLED), NETWORKS);
  const engine = await Engine.start(loading);
  const library = new Library(engine);
  for (const [file, name] of Object.entries(BUNDLED)) {
    await loading.file("The scenes", file, (blob) => library.openBackground(new File([blob], file), "panorama_file", name));
  }
  const [first] = library.backgrounds.keys();
  const work = new Work(emptyScene(first));
  const rendering = new Rendering(library, work, painterOn($("picture")), $("picture"));
  const cutter = new Cutter(library);
  const objects = new Objects(work, library, cutter, rendering);
  new Backgrounds(work, library, rendering);
  new Stage(work, rendering);
  new Lamp(work, rendering);
  new Video(work, library);
  new Saving(work, library);
  bindControls(work);
  bindSteps(work, cutter);
  bindBefore(rendering);
  for (const field of ["photo-file", "camera-file"]) fields.takeFiles(field, (file) => objects.add(file));
  showState(engine, rendering);
  rendering.refresh();
  document.body.classList.remove("starting");
  performance.mark("relight:usable");
  fields.takeWaiting();
  await firstPicture(rendering);
  await engine.prepare();
  await keepOffline();
}

/** The networks load after the first picture. */
function firstPicture(rendering) {
  return new Promise((resolve) => {
    for (const event of ["picture", "problem"]) rendering.addEventListener(event, resolve, { once: true });
  });
}

/** Undo and redo: in the sketch while an object is being cut out, else in the scene. */
function bindSteps(work, cutter) {
  const step = (by) => (by < 0 ? work.undo() : work.redo());
  $("undo").addEventListener("click", () => step(-1));
  $("redo").addEventListener("click", () => step(1));
  const show = () => {
    $("undo").disabled = !work.canUndo;
    $("redo").disabled = !work.canRedo;
  };
  work.addEventListener("scene", show);
  show();
  document.addEventListener("keydown", (event) => {
    const letter = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || (letter !== "z" && letter !== "y")) return;
    event.preventDefault();
    const by = letter === "y" || event.shiftKey ? 1 : -1;
    if (cutter.isOpen) cutter.step(by);
    else step(by);
  });
}

/** Held with a pointer; toggled with the keyboard. */
function bindBefore(rendering) {
  const button = $("before");
  const show = (before) => {
    button.setAttribute("aria-pressed", before);
    rendering.showBefore(before);
  };
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    show(true);
  });
  for (const end of ["pointerup", "pointercancel"]) button.addEventListener(end, () => show(false));
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("click", (event) => {
    if (event.detail === 0) show(button.getAttribute("aria-pressed") !== "true");
  });
}

/** The engine's activity, and its notes on the picture. */
function showState(engine, rendering) {
  let timer = 0;
  engine.addEventListener("busy", ({ detail }) => {
    clearTimeout(timer);
    timer = setTimeout(() => document.body.classList.toggle("busy", detail > 0), detail > 0 ? LONG : 0);
  });
  engine.addEventListener("restart", ({ detail }) => {
    notices.alert(detail);
    rendering.refresh();
  });
  rendering.addEventListener("problem", ({ detail }) => notices.alert(detail));
  rendering.addEventListener("state", () => (document.body.dataset.picture = rendering.rests ? "sharp" : "draft"));
  rendering.addEventListener("picture", () => {
    $("work").style.setProperty("--ratio", rendering.width / rendering.height);
    const notes = rendering.notes.join("\n");
    if ($("notes").dataset.text === notes) return;
    $("notes").dataset.text = notes;
    $("notes").replaceChildren(...rendering.notes.map((text) => make("li", { text })));
  });
}
