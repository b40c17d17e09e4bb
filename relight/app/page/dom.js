// Elements of the page: found by id, built from text and never from markup.

export const $ = (id) => document.getElementById(id);

/** An element with text, attributes, class and children. */
export function make(tag, { text, aria = {}, ...rest } = {}, ...children) {
  const element = Object.assign(document.createElement(tag), rest);
  if (text !== undefined) element.textContent = text;
  for (const [name, value] of Object.entries(aria)) element.setAttribute(`aria-${name}`, value);
  element.append(...children);
  return element;
}

/** A canvas that shows 8-bit RGBA pixels. */
export function canvasOf(rgba, width, height) {
  const canvas = make("canvas", { width, height });
  canvas.getContext("2d").putImageData(pixels(rgba, width, height), 0, 0);
  return canvas;
}

/** 8-bit RGBA bytes as the picture that a canvas takes. */
export function pixels(rgba, width, height) {
  return new ImageData(new Uint8ClampedArray(rgba.buffer, rgba.byteOffset, rgba.length), width, height);
}

export const clamp = (value, least, most) => Math.min(Math.max(value, least), most);
