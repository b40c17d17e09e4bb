// The picture on which a sketch is drawn: zoom and place on the canvas; mask, strokes, rectangle and cursor over it.

/** So many pixels of the screen a pixel of the picture can become. */
const CLOSEST = 32;
const COLOURS = { object: "#3ddc6c", background: "#ff5a5a" };
/** Strokes let so much of the picture through. */
const COVER = 0.5;

export class SketchView {
  /** The sketch as it is, and what is being drawn. */
  sketch = { rect: null, strokes: [] };
  stroke = null;
  rect = null;
  /** The brush under the pointer or the keys' cursor: { at, radius } or null. */
  brush = null;
  cross = null;
  x = 0;
  y = 0;
  scale = 1;

  #canvas;
  #picture = null;
  #mask = null;
  #fitted = true;
  #waiting = false;

  constructor(canvas) {
    this.#canvas = canvas;
    new ResizeObserver(() => this.#resize()).observe(canvas);
  }

  /** Shows all of a picture: { picture, width, height }, where `picture` may be null and of another size. */
  open(picture) {
    Object.assign(this, { stroke: null, rect: null, brush: null, cross: null });
    this.#picture = picture;
    this.#mask = null;
    this.#resize();
    this.fit();
  }

  /** Shows another picture in place of the one that was opened. */
  show(picture) {
    this.#picture = { ...this.#picture, picture };
    this.draw();
  }

  /** Paints the mask by a function of the context, in pixels of the picture, and of a pixel of the page; null for none. */
  setMask(paint) {
    this.#mask = paint;
    this.draw();
  }

  /** The place in the picture under a pointer. */
  place({ clientX, clientY }) {
    const box = this.#canvas.getBoundingClientRect();
    const ratio = this.#canvas.width / box.width;
    return [((clientX - box.left) * ratio - this.x) / this.scale, ((clientY - box.top) * ratio - this.y) / this.scale];
  }

  /** Pixels of the picture that are `css` pixels of the page. */
  length(css) {
    return (css * devicePixelRatio) / this.scale;
  }

  /** Zooms by a factor, so that a place of the page keeps its place in the picture. */
  zoom(factor, event = this.#middle()) {
    const [x, y] = this.place(event);
    const least = this.#fitScale();
    const scale = Math.min(Math.max(this.scale * factor, least), Math.max(CLOSEST, least));
    this.x += x * (this.scale - scale);
    this.y += y * (this.scale - scale);
    this.scale = scale;
    this.#fitted = scale === least;
    this.#hold();
  }

  /** Moves the picture by a way on the page. */
  move(dx, dy) {
    this.x += dx * devicePixelRatio;
    this.y += dy * devicePixelRatio;
    this.#hold();
  }

  fit() {
    this.#fitted = true;
    this.scale = this.#fitScale();
    this.#hold();
  }

  /** Draws before the next picture of the screen. */
  draw() {
    if (this.#waiting || !this.#picture) return;
    this.#waiting = true;
    requestAnimationFrame(() => {
      this.#waiting = false;
      this.#paint();
    });
  }

  #middle() {
    const box = this.#canvas.getBoundingClientRect();
    return { clientX: box.left + box.width / 2, clientY: box.top + box.height / 2 };
  }

  #fitScale() {
    return Math.min(this.#canvas.width / this.#picture.width, this.#canvas.height / this.#picture.height);
  }

  #resize() {
    const box = this.#canvas.getBoundingClientRect();
    if (!this.#picture || box.width === 0) return;
    this.#canvas.width = Math.round(box.width * devicePixelRatio);
    this.#canvas.height = Math.round(box.height * devicePixelRatio);
    if (this.#fitted) this.fit();
    else this.#hold();
  }

  /** Keeps the picture in sight: centred where it is smaller than the canvas. */
  #hold() {
    const hold = (at, side, canvas) => (side <= canvas ? (canvas - side) / 2 : Math.min(0, Math.max(canvas - side, at)));
    this.x = hold(this.x, this.#picture.width * this.scale, this.#canvas.width);
    this.y = hold(this.y, this.#picture.height * this.scale, this.#canvas.height);
    this.draw();
  }

  #paint() {
    const context = this.#canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    context.setTransform(this.scale, 0, 0, this.scale, this.x, this.y);
    // Where the picture is on the screen, for tests and for programs that help to use the page.
    this.#canvas.dataset.view = [this.scale, this.x, this.y].map((value) => value / devicePixelRatio).join(" ");
    context.imageSmoothingEnabled = this.scale < 3;
    const pixel = devicePixelRatio / this.scale;
    const { picture, width, height } = this.#picture;
    if (picture) context.drawImage(picture, 0, 0, width, height);
    this.#mask?.(context, pixel);
    const strokes = [...this.sketch.strokes, ...(this.stroke ? [this.stroke] : [])];
    if (strokes.length > 0) this.#paintStrokes(context, strokes);
    const rect = this.rect ?? this.sketch.rect;
    if (rect) paintRect(context, rect, pixel);
    if (this.brush) paintRing(context, this.brush, pixel);
    if (this.cross) paintCross(context, this.cross, pixel);
  }

  /** Strokes on a layer of their own, so that the eraser takes away what lies under it. */
  #paintStrokes(context, strokes) {
    const layer = new OffscreenCanvas(this.#canvas.width, this.#canvas.height);
    const paint = layer.getContext("2d");
    paint.setTransform(context.getTransform());
    paint.lineCap = paint.lineJoin = "round";
    for (const { brush, radius, points } of strokes) {
      for (const mode of brush === "eraser" ? ["destination-out"] : ["destination-out", "source-over"]) {
        paint.globalCompositeOperation = mode;
        paint.strokeStyle = mode === "source-over" ? COLOURS[brush] : "#000";
        paint.lineWidth = 2 * radius;
        paint.beginPath();
        paint.moveTo(...points[0]);
        for (const point of points.length > 1 ? points.slice(1) : points) paint.lineTo(...point);
        paint.stroke();
      }
    }
    context.save();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = COVER;
    context.drawImage(layer, 0, 0);
    context.restore();
  }
}

/** The corners of a rectangle: upper left, upper right, lower right, lower left. */
export function corners([x, y, w, h]) {
  return [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
}

function paintRect(context, rect, pixel) {
  for (const [colour, weight, dash] of [["#000c", 3.5, []], ["#fff", 1.5, [6, 5]]]) {
    context.strokeStyle = colour;
    context.lineWidth = weight * pixel;
    context.setLineDash(dash.map((part) => part * pixel));
    context.strokeRect(...rect);
  }
  context.setLineDash([]);
  const side = 10 * pixel;
  context.fillStyle = "#fff";
  for (const [x, y] of corners(rect)) context.fillRect(x - side / 2, y - side / 2, side, side);
}

function paintRing(context, { at, radius }, pixel) {
  for (const [colour, weight] of [["#000a", 3], ["#fff", 1.3]]) {
    context.beginPath();
    context.arc(...at, radius, 0, 2 * Math.PI);
    context.strokeStyle = colour;
    context.lineWidth = weight * pixel;
    context.stroke();
  }
}

function paintCross(context, [x, y], pixel) {
  const arm = 14 * pixel;
  for (const [colour, weight] of [["#000", 4], ["#fff", 1.6]]) {
    context.beginPath();
    context.moveTo(x - arm, y);
    context.lineTo(x + arm, y);
    context.moveTo(x, y - arm);
    context.lineTo(x, y + arm);
    context.strokeStyle = colour;
    context.lineWidth = weight * pixel;
    context.stroke();
  }
}
