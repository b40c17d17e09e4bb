// The canvas: the frame, the mask's outline and what is drawn, at any zoom.

/** Least and most pixels of the screen for a pixel of the frame, beyond the fitting one. */
const CLOSEST = 32;
const COLOURS = { object: "#4cd97b99", background: "#e8504f99", eraser: "#ffffff66" };

export class View {
  /** Pixels of the canvas for a pixel of the frame, and where the frame's corner is on the canvas. */
  scale = 1;
  x = 0;
  y = 0;
  image = null;
  outline = null;
  sketch = null;
  /** A stroke or rectangle that is being drawn. */
  stroke = null;
  rect = null;
  /** The brush under the pointer: { at, radius }. */
  brush = null;
  stale = false;

  #canvas;
  #size;
  #fitted = true;
  #waiting = false;

  constructor(canvas, width, height) {
    this.#canvas = canvas;
    this.#size = { width, height };
    new ResizeObserver(() => this.#resize()).observe(canvas);
  }

  /** Shows polygons as the mask. */
  setOutline(polygons) {
    this.outline = polygons && new Path2D(polygons.map((corners) => `M${corners.map((c) => c.join(" ")).join("L")}Z`).join(""));
    this.draw();
  }

  /** The place in the frame under a pointer. */
  place(event) {
    const box = this.#canvas.getBoundingClientRect();
    const ratio = this.#canvas.width / box.width;
    return [((event.clientX - box.left) * ratio - this.x) / this.scale, ((event.clientY - box.top) * ratio - this.y) / this.scale];
  }

  /** Pixels of the frame that are `css` pixels of the page. */
  length(css) {
    return (css * devicePixelRatio) / this.scale;
  }

  /** Zooms by a factor, so that a place of the page keeps its place in the frame. */
  zoom(factor, event) {
    const at = event ?? this.#middle();
    const [x, y] = this.place(at);
    const least = this.#fitScale();
    const scale = Math.min(Math.max(this.scale * factor, least), Math.max(CLOSEST, least));
    this.x += x * (this.scale - scale);
    this.y += y * (this.scale - scale);
    this.scale = scale;
    this.#fitted = scale === least;
    this.#hold();
  }

  /** Moves the frame by a way on the page. */
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
    if (this.#waiting) return;
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
    return Math.min(this.#canvas.width / this.#size.width, this.#canvas.height / this.#size.height);
  }

  #resize() {
    const box = this.#canvas.getBoundingClientRect();
    this.#canvas.width = Math.max(1, Math.round(box.width * devicePixelRatio));
    this.#canvas.height = Math.max(1, Math.round(box.height * devicePixelRatio));
    if (this.#fitted) this.fit();
    else this.#hold();
  }

  /** Keeps the frame in sight: centred where it is smaller than the canvas. */
  #hold() {
    const hold = (at, frame, canvas) => (frame <= canvas ? (canvas - frame) / 2 : Math.min(0, Math.max(canvas - frame, at)));
    this.x = hold(this.x, this.#size.width * this.scale, this.#canvas.width);
    this.y = hold(this.y, this.#size.height * this.scale, this.#canvas.height);
    this.draw();
  }

  #paint() {
    const context = this.#canvas.getContext("2d");
    const { width, height } = this.#size;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    context.setTransform(this.scale, 0, 0, this.scale, this.x, this.y);
    // For tests and for helpers of the page: where the frame is on the screen.
    this.#canvas.dataset.view = [this.scale / devicePixelRatio, this.x / devicePixelRatio, this.y / devicePixelRatio].join(" ");
    context.imageSmoothingEnabled = this.scale < 3;
    if (this.image) context.drawImage(this.image, 0, 0, width, height);
    const thick = devicePixelRatio / this.scale;
    if (this.outline) {
      const outside = new Path2D();
      outside.rect(0, 0, width, height);
      outside.addPath(this.outline);
      context.fillStyle = "#0007";
      context.fill(outside, "evenodd");
      context.lineJoin = "round";
      for (const [colour, weight] of [["#000c", 3.5], [this.stale ? "#ffd28a" : "#39ff6e", 1.6]]) {
        context.strokeStyle = colour;
        context.lineWidth = weight * thick;
        context.stroke(this.outline);
      }
    }
    this.#paintSketch(context, thick);
  }

  #paintSketch(context, thick) {
    const strokes = [...(this.sketch?.strokes ?? []), ...(this.stroke ? [this.stroke] : [])];
    if (strokes.length > 0) this.#paintStrokes(context, strokes);
    const rect = this.rect ?? this.sketch?.rect;
    if (rect) {
      for (const [colour, weight, dash] of [["#000c", 3.5, []], ["#fff", 1.5, [6, 5]]]) {
        context.strokeStyle = colour;
        context.lineWidth = weight * thick;
        context.setLineDash(dash.map((part) => part * thick));
        context.strokeRect(...rect);
      }
      context.setLineDash([]);
      const side = 9 * thick;
      context.fillStyle = "#fff";
      for (const [x, y] of corners(rect)) context.fillRect(x - side / 2, y - side / 2, side, side);
    }
    if (this.brush) {
      context.beginPath();
      context.arc(...this.brush.at, this.brush.radius, 0, 2 * Math.PI);
      context.strokeStyle = "#fff";
      context.lineWidth = 1.2 * thick;
      context.stroke();
    }
  }

  /** Strokes on a layer of their own, so that the eraser takes away what lies under it. */
  #paintStrokes(context, strokes) {
    const layer = new OffscreenCanvas(this.#canvas.width, this.#canvas.height);
    const paint = layer.getContext("2d");
    paint.setTransform(this.scale, 0, 0, this.scale, this.x, this.y);
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
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(layer, 0, 0);
    context.setTransform(this.scale, 0, 0, this.scale, this.x, this.y);
  }
}

/** The corners of a rectangle: upper left, upper right, lower right, lower left. */
export function corners([x, y, w, h]) {
  return [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
}
