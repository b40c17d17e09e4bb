// Composes the picture of the scene from the engine's layers on the graphics card: shadows are multiplied into the background, then
// objects are laid over it, all in linear light. Layers can be moved from where they were made, until new ones arrive.

const VERTEX = `#version 300 es
uniform mat3 place;
uniform vec2 picture;
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  vec2 pixel = (place * vec3(at, 1)).xy;
  gl_Position = vec4(2.0 * pixel.x / picture.x - 1.0, 1.0 - 2.0 * pixel.y / picture.y, 0, 1);
}`;

/** A texel of an object is its light times its alpha: what is not covered has no colour, and texels can be mixed. */
const LAYER = `#version 300 es
precision highp float;
uniform sampler2D layer;
uniform bool shadow;
in vec2 at;
out vec4 colour;
vec4 texel(ivec2 at, ivec2 size) {
  bool outside = any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size));
  if (outside) return shadow ? vec4(1) : vec4(0);
  return texelFetch(layer, at, 0);
}
void main() {
  ivec2 size = textureSize(layer, 0);
  vec2 place = at * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(place));
  vec2 part = place - vec2(low);
  vec4 upper = mix(texel(low, size), texel(low + ivec2(1, 0), size), part.x);
  vec4 lower = mix(texel(low + ivec2(0, 1), size), texel(low + ivec2(1, 1), size), part.x);
  colour = mix(upper, lower, part.y);
}`;

const SCREEN = `#version 300 es
precision highp float;
uniform sampler2D layer;
in vec2 at;
out vec4 colour;
void main() {
  vec3 light = texelFetch(layer, ivec2(vec2(at.x, 1.0 - at.y) * vec2(textureSize(layer, 0))), 0).rgb;
  colour = vec4(mix(light * 12.92, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light)), 1);
}`;

/** A painter on a canvas: with WebGL2, else without. */
export function painterOn(canvas) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
  return gl ? new LayerPainter(canvas, gl) : new PlainPainter(canvas);
}

/** Shows whole pictures. */
class PlainPainter {
  layered = false;
  #context;

  constructor(canvas) {
    this.#context = canvas.getContext("2d", { alpha: false });
  }

  /** Shows a picture: { width, height, parts: [RGBA] }. */
  show({ width, height, parts }) {
    const { canvas } = this.#context;
    [canvas.width, canvas.height] = [width, height];
    const rgba = new Uint8ClampedArray(parts[0].buffer, parts[0].byteOffset, parts[0].length);
    this.#context.putImageData(new ImageData(rgba, width, height), 0, 0);
  }
}

/** Shows layers. */
class LayerPainter {
  layered = true;
  #canvas;
  #gl;
  #programs;
  #size = { width: 0, height: 0 };
  #background = null;
  #objects = [];
  #target = null;
  #frame = null;

  constructor(canvas, gl) {
    this.#canvas = canvas;
    this.#gl = gl;
    this.#begin();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.#begin();
      canvas.dispatchEvent(new Event("empty"));
    });
  }

  /** Takes the layers of an answer: { width, height, objects, parts }; those of a plain picture have no objects. */
  load({ width, height, objects = [], parts }) {
    this.#drop();
    this.#resize(width, height);
    const rest = [...parts];
    this.#background = this.#texture(rest.shift(), width, height, true);
    this.#objects = objects.map((layer) => ({
      ...layer,
      texture: this.#texture(rest.shift(), layer.width, layer.height, true),
      shade: layer.shadow && this.#texture(rest.shift(), layer.shadow.width, layer.shadow.height, false),
    }));
  }

  /** Shows a picture: { width, height, parts: [RGBA] }. */
  show(picture) {
    this.load({ ...picture, objects: [] });
    this.paint([]);
  }

  /** Paints layers by their number, from back to front, each moved as told: [{ layer, dx, dy, scale, turn, foot }]. */
  paint(moves) {
    const gl = this.#gl;
    const { width, height } = this.#size;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    this.#draw(this.#programs.layer, this.#background, [width, 0, 0, 0, height, 0, 0, 0, 1]);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.DST_COLOR, gl.ZERO);
    for (const move of moves) {
      const { shadow, shade } = this.#objects[move.layer];
      if (shade) this.#draw(this.#programs.layer, shade, placed(shadow, { ...move, turn: 0 }, middle(shadow)), true);
    }
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    for (const move of moves) {
      const layer = this.#objects[move.layer];
      this.#draw(this.#programs.layer, layer.texture, placed(layer, move, middle(layer)));
    }
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.#draw(this.#programs.screen, this.#target, [width, 0, 0, 0, height, 0, 0, 0, 1]);
  }

  #begin() {
    this.#programs = { layer: program(this.#gl, LAYER), screen: program(this.#gl, SCREEN) };
    this.#size = { width: 0, height: 0 };
    this.#background = this.#target = this.#frame = null;
    this.#objects = [];
  }

  #draw({ program, uniforms }, texture, place, shadow = false) {
    const gl = this.#gl;
    gl.useProgram(program);
    gl.uniform2f(uniforms.picture, this.#size.width, this.#size.height);
    gl.uniformMatrix3fv(uniforms.place, false, place);
    if (uniforms.shadow) gl.uniform1i(uniforms.shadow, shadow);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /** The canvas and the picture in linear light get the size of a picture. */
  #resize(width, height) {
    if (this.#size.width === width && this.#size.height === height) return;
    const gl = this.#gl;
    this.#size = { width, height };
    [this.#canvas.width, this.#canvas.height] = [width, height];
    gl.deleteTexture(this.#target);
    gl.deleteFramebuffer(this.#frame);
    this.#target = this.#texture(null, width, height, true);
    this.#frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.#target, 0);
  }

  #texture(bytes, width, height, isColour) {
    const gl = this.#gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, isColour ? gl.SRGB8_ALPHA8 : gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    return texture;
  }

  #drop() {
    for (const { texture, shade } of this.#objects) {
      this.#gl.deleteTexture(texture);
      if (shade) this.#gl.deleteTexture(shade);
    }
    this.#gl.deleteTexture(this.#background);
  }
}

const middle = ({ place: [x, y], width, height }) => [x + width / 2, y + height / 2];

/**
 * From a layer's unit square to pixels of the picture, column by column: scaled about the object's foot and moved with it, turned
 * counter-clockwise about its own middle.
 */
function placed({ width, height }, { scale, turn, foot, dx, dy }, [x, y]) {
  const [sin, cos] = [Math.sin((turn * Math.PI) / 180), Math.cos((turn * Math.PI) / 180)];
  const [w, h] = [width * scale, height * scale];
  const [cx, cy] = [foot[0] + dx + (x - foot[0]) * scale, foot[1] + dy + (y - foot[1]) * scale];
  const [ax, ay, bx, by] = [cos * w, -sin * w, sin * h, cos * h];
  return [ax, ay, 0, bx, by, 0, cx - (ax + bx) / 2, cy - (ay + by) / 2, 1];
}

function program(gl, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(`The graphics card cannot run the page's shaders: ${gl.getProgramInfoLog(program)}`);
  const uniforms = Object.fromEntries(["place", "picture", "shadow"].map((name) => [name, gl.getUniformLocation(program, name)]));
  return { program, uniforms };
}
