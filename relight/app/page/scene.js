// The scene: objects, their places and the light. Plain values; every change makes a new scene.

export const MOST_OBJECTS = 12;
/** The engine's fields of a scene, without its light and those of its objects. */
const FIELDS = ["size", "fov", "down", "tilt", "match", "white_balance", "exposure"];
const OBJECT_FIELDS = ["object", "at", "height", "rotation", "tint", "gloss", "exposure", "shadow"];
const LIGHT = { kind: "background", azimuth: 45, elevation: 45, colour: "#ffffff", size: 30, ambient: 0.15, angle: 0 };
/** The offset of a copy from its original, in parts of the picture. */
const BESIDE = 0.08;

let keys = 0;

export const emptyScene = (background) => ({
  background, size: [1280, 960], fov: 60, down: 10, match: true, white_balance: "adapted", exposure: 0, light: LIGHT, objects: [],
});

/** A new object of a scene. `key` is its name in the page as long as it exists. */
export function newObject(object, place) {
  return { key: ++keys, object, at: [0.5, 0.9], height: 0.4, rotation: 0, tint: [1, 1, 1], gloss: null, exposure: 0, shadow: 1, ...place };
}

/** The scene as the engine takes it. */
export function forEngine(scene) {
  return { ...pick(scene, FIELDS), light: lightForEngine(scene.light), objects: scene.objects.map((object) => pick(object, OBJECT_FIELDS)) };
}

function lightForEngine({ kind, azimuth, elevation, colour, size, ambient, angle }) {
  return kind === "lamp" ? { lamp: [azimuth, elevation, colour, size].join(), ambient, angle } : { angle };
}

export function added(scene, object) {
  if (scene.objects.length >= MOST_OBJECTS) throw new Error(`A scene can have at most ${MOST_OBJECTS} objects: remove one first.`);
  return { ...scene, objects: [...scene.objects, object] };
}

export function changed(scene, key, parts) {
  return { ...scene, objects: scene.objects.map((object) => (object.key === key ? { ...object, ...parts } : object)) };
}

export function removed(scene, key) {
  return { ...scene, objects: scene.objects.filter((object) => object.key !== key) };
}

/** A second object of the same photograph, beside the first and before it. */
export function duplicated(scene, key) {
  const { key: _, ...object } = find(scene, key);
  const x = object.at[0] > 0.5 ? object.at[0] - BESIDE : object.at[0] + BESIDE;
  return added(scene, newObject(object.object, { ...object, at: [x, object.at[1]] }));
}

/** Moves the object a step nearer to the viewer, or farther by -1. */
export function reordered(scene, key, step) {
  const objects = [...scene.objects];
  const from = objects.findIndex((object) => object.key === key);
  const to = from + step;
  if (from < 0 || to < 0 || to >= objects.length) return scene;
  [objects[from], objects[to]] = [objects[to], objects[from]];
  return { ...scene, objects };
}

/** The azimuth at which the lamp appears, with the rotation of the light. */
export const lampAzimuth = ({ azimuth, angle }) => around(azimuth + angle);

/** A lamp that appears at an azimuth. */
export const lampAt = (azimuth, { angle }) => ({ azimuth: around(azimuth - angle) });

const around = (degrees) => Math.round(((degrees % 360) + 360) % 360) % 360;

export const find = (scene, key) => scene.objects.find((object) => object.key === key);

/** The scene as text, without placements: two scenes with the same text differ in placement only. */
export function lookOf(scene) {
  const objects = scene.objects.map(({ at, height, rotation, ...look }) => look);
  return JSON.stringify({ ...scene, objects });
}

const pick = (from, names) => Object.fromEntries(names.map((name) => [name, from[name]]));
