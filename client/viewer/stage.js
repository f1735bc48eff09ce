// The room in which things are shown: renderer, camera, controls, scale bar and axes.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const AXIS_COLOURS = { x: "#ff6b6b", y: "#6bd66b", z: "#6ba8ff" };
const FIELD_OF_VIEW = 32; // degrees
const SCALE_BAR_PIXELS = 140; // at most

/** Smooth edges cost nothing on a graphics card, and a second of each picture of a large cloud without one. */
function newRenderer() {
  const attributes = { alpha: false, antialias: false, preserveDrawingBuffer: true };
  const make = () => document.createElement("canvas").getContext("webgl2", attributes);
  let gl = make(); // where it is drawn in software, this is slow: once is enough
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const isSoftware = names && /swiftshader|llvmpipe|softpipe/i.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
  if (gl && !isSoftware) {
    gl.getExtension("WEBGL_lose_context")?.loseContext(); // browsers keep few
    attributes.antialias = true;
    gl = make();
  }
  return new THREE.WebGLRenderer(gl ? { canvas: gl.canvas, context: gl } : attributes);
}

export class Stage {
  /** `pole` is the direction that counts as up; `front` the one from which things are looked at first. */
  constructor({ pole, front }) {
    this.host = document.getElementById("stage");
    this.pole = pole.clone().normalize();
    this.front = front.clone().normalize();
    this.renderer = newRenderer();
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.host.prepend(this.renderer.domElement);
    this.canvas = this.renderer.domElement;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color("#12161c");
    this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 1, 1e5);
    this.camera.up.copy(this.pole);
    this.pixels = { value: 1 }; // uniform: of the canvas, that a millimetre at a distance of one takes
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.render());
    this.triad = new Triad(document.getElementById("axes"));
    new ResizeObserver(() => this.resize()).observe(this.host);
    this.resize();
  }

  /** Looks at a sphere from `tilt` degrees off the pole; without a tilt, from where the camera stands. */
  look(centre, radius, tilt) {
    const offset = new THREE.Vector3();
    if (tilt === undefined) {
      offset.subVectors(this.camera.position, this.controls.target).normalize();
    } else {
      const angle = THREE.MathUtils.degToRad(Math.max(tilt, 0.01));
      offset.addScaledVector(this.pole, Math.cos(angle)).addScaledVector(this.front, Math.sin(angle));
    }
    const half = THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2);
    const narrow = Math.atan(Math.tan(half) * Math.min(1, this.camera.aspect));
    const distance = radius / Math.sin(narrow);
    this.camera.near = distance / 100;
    this.camera.far = distance * 100;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(offset, distance);
    this.controls.update();
    this.render();
  }

  /** Turns the camera about the pole. */
  turn(degrees) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(this.pole, THREE.MathUtils.degToRad(degrees));
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.render();
  }

  /** Calls `act` with the nearest of `objects` under a click or tap, or with nothing. */
  onPick(objects, act) {
    let down = null;
    // The second finger of a pinch is not primary.
    this.canvas.addEventListener("pointerdown", (event) => (down = event.isPrimary ? [event.clientX, event.clientY] : null));
    this.canvas.addEventListener("pointerup", (event) => {
      const still = event.pointerType === "touch" ? 12 : 5; // pixels: fingers roll
      if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > still) return; // a drag
      const box = this.canvas.getBoundingClientRect();
      const ray = new THREE.Raycaster();
      const at = new THREE.Vector2(((event.clientX - box.left) / box.width) * 2 - 1,
        1 - ((event.clientY - box.top) / box.height) * 2);
      ray.setFromCamera(at, this.camera);
      act(ray.intersectObjects(objects().filter(isShown), false)[0]?.object);
    });
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height || (width === this.width && height === this.height)) return;
    Object.assign(this, { width, height });
    this.renderer.setSize(width, height, false);
    this.pixels.value = this.canvas.height / 2 / Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2));
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  /** Draws once, with the next frame; however often it is asked. */
  render() {
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => {
      this.isAsked = false;
      this.renderer.render(this.scene, this.camera);
      this.drawScale();
      this.triad.turn(this.camera);
    });
  }

  /** The scale bar holds at the depth of the point that the camera turns about. */
  drawScale() {
    const distance = this.camera.position.distanceTo(this.controls.target);
    const perPixel = (2 * distance * Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2))) / this.host.clientHeight;
    const most = SCALE_BAR_PIXELS * perPixel;
    const decade = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((n) => n * decade).find((n) => n <= most);
    const bar = document.getElementById("scale");
    bar.firstElementChild.style.width = `${length / perPixel}px`;
    bar.lastElementChild.textContent = length < 1000 ? `${+length.toPrecision(1)} mm` : `${length / 1000} m`;
  }
}

const isShown = (object) => object === null || (object.visible && isShown(object.parent));

/** The axes of the scene frame as the camera sees them, drawn in a corner. */
class Triad {
  constructor(host) {
    const line = (name) => `<line x2="0" y2="0" stroke="${AXIS_COLOURS[name]}"/><text fill="${AXIS_COLOURS[name]}">${name}</text>`;
    host.innerHTML = `<svg viewBox="-40 -40 80 80">${["x", "y", "z"].map((name) => `<g>${line(name)}</g>`).join("")}</svg>`;
    this.groups = [...host.querySelectorAll("g")];
  }

  turn(camera) {
    const inverse = camera.quaternion.clone().invert();
    const drawn = this.groups.map((group, i) => {
      const axis = new THREE.Vector3().setComponent(i, 1).applyQuaternion(inverse);
      const [line, text] = group.children;
      line.setAttribute("x2", 26 * axis.x);
      line.setAttribute("y2", -26 * axis.y);
      text.setAttribute("x", 34 * axis.x);
      text.setAttribute("y", -34 * axis.y);
      return [axis.z, group];
    });
    for (const [, group] of drawn.sort(([a], [b]) => a - b)) group.parentNode.append(group);
  }
}

/** A frame as three coloured lines. */
export function frameLines(length) {
  const lines = new THREE.AxesHelper(length);
  lines.setColors(AXIS_COLOURS.x, AXIS_COLOURS.y, AXIS_COLOURS.z);
  lines.material.depthTest = false;
  lines.renderOrder = 1;
  return lines;
}

/** Words at a place, upright and of the same size from wherever they are looked at. */
export function labelAt(place, text, colour) {
  const kHeight = 0.022; // of the picture's, per unit of distance
  const context = document.createElement("canvas").getContext("2d");
  const font = "600 44px system-ui, sans-serif";
  context.font = font;
  const { canvas } = context;
  [canvas.width, canvas.height] = [Math.ceil(context.measureText(text).width) + 16, 60];
  Object.assign(context, { font, fillStyle: colour, textBaseline: "middle" });
  context.fillText(text, 8, canvas.height / 2);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false, sizeAttenuation: false }));
  sprite.scale.set((kHeight * canvas.width) / canvas.height, kHeight, 1);
  sprite.center.set(0.5, 0);
  sprite.position.copy(place);
  return sprite;
}
