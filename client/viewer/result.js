// The result of a detection: the cloud, the parts found in it, a list beside them.
import * as THREE from "three";
import { cloudPoints } from "./cloud.js";
import { gradientOf, scoreColour } from "./colour.js";
import { addSwitch, element, facts, onKey, sayKeys, warn } from "./panel.js";
import { FlatMaterial } from "./shading.js";
import { Stage, frameLines } from "./stage.js";
import { cloudOf, matrixOf, millimetresPer, surfaceOf, vectorOf } from "./wire.js";

const MOST_TRIANGLES_WITH_EDGES = 60000;
const EDGE_ANGLE = 30; // degrees between the faces at an edge that is drawn
const MEASURED_PART = 0.03; // of a part's diameter: what lies so near its surface is that surface
const OBLIQUE = 38; // degrees off the direction to the sensor

export function showResult(data) {
  const unit = millimetresPer(data.request.cloud.unit);
  const sensor = vectorOf(data.request.cloud.sensorPosition, unit);
  const cloud = cloudOf(data.request.cloud);
  const stage = new Stage(directionsOf(cloud, sensor));
  const smallest = Math.min(...data.models.map(({ model }) => 1000 * model.diameter));
  const points = cloudPoints(stage, cloud, sensor, MEASURED_PART * smallest);
  const shapes = new Map(data.models.map((entry) => [entry.model.id, new PartShape(entry)]));
  const found = group(data.answer.hypotheses, (h) => shapes.get(h.modelId).solid(matrixOf(h.pose, unit), scoreColour(h.score), stage.pole));
  const rejected = group(data.answer.rejected, (h) => shapes.get(h.modelId).outline(matrixOf(h.pose, unit), "#ff5d8f", 0.18));
  const truth = group(data.truth?.instances, (t) => [...shapes.values()][0].outline(new THREE.Matrix4().set(...t.pose), "#ffffff", 0));
  stage.scene.add(points, found, rejected, truth);

  addSwitch(stage, "c", "Cloud", points);
  addSwitch(stage, "p", "Parts", found);
  if (data.truth) addSwitch(stage, "t", "Truth", truth);
  addSwitch(stage, "r", `Rejected (${rejected.children.length})`, rejected, false);
  describe(data, found.children.length);
  const select = new PartList(stage, data, found, shapes, unit).bind();

  const { centre, radius } = points.userData;
  const home = (tilt) => stage.look(centre, 0.82 * radius, tilt);
  onKey("0", () => home(0));
  onKey("1", () => home(OBLIQUE));
  onKey("Escape", () => select(null));
  onKey("ArrowLeft", () => stage.turn(-10));
  onKey("ArrowRight", () => stage.turn(10));
  sayKeys([["↑ ↓", "part"], ["← →", "turn"], ["0", "sensor's view"], ["1", "oblique"], ["c p t r", "show"], ["Esc", "none"]]);
  home(OBLIQUE);
}

/** Up is towards the sensor; the front is the lower edge of its image. */
function directionsOf({ xyz }, sensor) {
  const middle = new THREE.Vector3();
  let count = 0;
  for (let i = 0; i < xyz.length; i += 3 * 37) {
    if (!Number.isFinite(xyz[i] + xyz[i + 1] + xyz[i + 2])) continue;
    middle.add(new THREE.Vector3().fromArray(xyz, i));
    ++count;
  }
  const pole = sensor.clone().sub(middle.divideScalar(count || 1));
  if (pole.lengthSq() === 0) pole.set(0, 0, -1);
  pole.normalize();
  const front = new THREE.Vector3(0, 1, 0).addScaledVector(pole, -pole.y);
  if (front.lengthSq() < 0.01) front.set(0, 0, -1).addScaledVector(pole, pole.z);
  return { pole, front };
}

function group(list, make) {
  const made = new THREE.Group();
  for (const item of list ?? []) made.add(make(item));
  return made;
}

/** What a model looks like, made once and put wherever it was found. */
class PartShape {
  constructor(entry) {
    this.model = entry.model;
    this.surface = surfaceOf(entry);
    this.surface.computeBoundingSphere();
    const triangles = (this.surface.index ?? this.surface.attributes.position).count / 3;
    const hasEdges = entry.mesh && triangles <= MOST_TRIANGLES_WITH_EDGES;
    this.edges = hasEdges ? new THREE.EdgesGeometry(this.surface, EDGE_ANGLE) : null;
  }

  solid(matrix, colour, pole) {
    const material = new FlatMaterial(pole, { colour, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    const part = place(new THREE.Mesh(this.surface, material), matrix);
    if (this.edges) {
      const line = new THREE.LineBasicMaterial({ color: colour.clone().multiplyScalar(0.25) });
      part.add(new THREE.LineSegments(this.edges, line));
    }
    return part;
  }

  outline(matrix, colour, opacity) {
    const material = new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: this.edges ? opacity : 0.3,
      depthWrite: !this.edges }); // of discs that overlap, one
    const part = place(new THREE.Mesh(this.surface, material), matrix);
    if (this.edges) part.add(new THREE.LineSegments(this.edges, new THREE.LineBasicMaterial({ color: colour })));
    return part;
  }
}

function place(object, matrix) {
  object.applyMatrix4(matrix);
  object.updateMatrixWorld(true);
  return object;
}

function describe(data, count) {
  const { stats = {} } = data.answer;
  document.getElementById("summary").textContent =
    `${count === 0 ? "nothing" : count} found in ${(1000 * (stats.totalSeconds ?? 0)).toFixed(0)} ms, ` +
    `${Number(stats.pointCount ?? 0).toLocaleString("en")} points`;
  warn(data.answer.warnings);
}

/** The list, and what is selected in it. */
class PartList {
  constructor(stage, data, found, shapes, unit) {
    Object.assign(this, { stage, found, shapes, unit, hypotheses: data.answer.hypotheses ?? [], selected: null });
    this.frame = frameLines(1);
    this.frame.visible = false;
    this.variants = new THREE.Group(); // of the selected part: the poses that the scan leaves open
    stage.scene.add(this.frame, this.variants);
    this.rows = this.hypotheses.map((hypothesis, i) => this.row(hypothesis, i));
  }

  /** Puts the list on the page and answers with what selects a part, or none. */
  bind() {
    const legend = element("div", { class: "legend" }, element("i", { style: { background: gradientOf(scoreColour, 0.3, 1) } }),
      element("span", {}, element("b", {}, "score 0.3"), element("b", {}, "1")));
    const head = element("div", { class: "head" }, ...["#", "part", "", "score", "visible"].map((name) => element("span", {}, name)));
    document.getElementById("list").append(...(this.rows.length ? [legend, head, ...this.rows] : []));
    const select = (i) => this.select(i);
    this.stage.onPick(() => this.found.children, (object) => select(object ? this.found.children.indexOf(object) : null));
    const step = (by) => this.rows.length && select(this.selected === null ? 0 : (this.selected + by + this.rows.length) % this.rows.length);
    onKey("ArrowDown", () => step(1));
    onKey("ArrowUp", () => step(-1));
    return select;
  }

  row(hypothesis, i) {
    const colour = scoreColour(hypothesis.score).getStyle();
    const bar = element("span", { class: "bar" }, element("i", { style: { width: `${100 * hypothesis.score}%`, background: colour } }));
    const button = element("button", { type: "button" }, element("span", { class: "rank" }, `${i + 1}`),
      element("span", { class: "name" }, hypothesis.modelId), bar, element("span", { class: "number" }, hypothesis.score.toFixed(3)),
      element("span", { class: "number" }, percent(hypothesis.visibleFraction)));
    if (doubtOf(hypothesis)) button.append(element("span", { class: "doubt" }, doubtOf(hypothesis)));
    button.addEventListener("click", () => this.select(i));
    return element("article", { class: "part" }, button);
  }

  select(i) {
    if (this.selected !== null) {
      const row = this.rows[this.selected];
      row.removeAttribute("aria-current");
      row.querySelector("dl").remove();
    }
    this.selected = i;
    this.found.children.forEach((part, k) => {
      part.material.glow = k === i ? 0.35 : 0;
      part.material.fade(i === null || k === i ? 1 : 0.35);
    });
    this.frame.visible = i !== null;
    this.variants.clear();
    if (i !== null) this.showSelected(i);
    this.stage.render();
  }

  showSelected(i) {
    const row = this.rows[i], part = this.found.children[i];
    row.setAttribute("aria-current", "true");
    row.append(facts(factsOf(this.hypotheses[i], this.unit)));
    row.scrollIntoView({ block: "nearest" });
    const shape = this.shapes.get(this.hypotheses[i].modelId);
    for (const pose of this.hypotheses[i].variants ?? []) {
      this.variants.add(shape.outline(matrixOf(pose, this.unit), "#ffd166", 0.12));
    }
    const { surface, model } = shape;
    this.frame.position.copy(part.position);
    this.frame.quaternion.copy(part.quaternion);
    this.frame.scale.setScalar(500 * model.diameter);
    this.stage.look(surface.boundingSphere.center.clone().applyMatrix4(part.matrixWorld), 2.2 * surface.boundingSphere.radius);
  }
}

const percent = (share) => `${(100 * (share ?? 0)).toFixed(0)} %`;

/** What keeps a pose from being sure; empty if nothing does. */
function doubtOf({ variants, confidence = 1 }) {
  if (variants?.length) return `ambiguous, ${percent(confidence)} sure`;
  return confidence < 0.995 ? `${percent(confidence)} sure` : "";
}

function factsOf(h, unit) {
  const position = vectorOf(h.pose.position, unit).toArray();
  const { x = 0, y = 0, z = 0, w = 0 } = h.pose.orientation;
  const list = [
    ["position", `${position.map((v) => v.toFixed(2)).join("  ")} mm`],
    ["quaternion", [x, y, z, w].map((v) => v.toFixed(4)).join("  ")],
    ["explained", percent(h.explainedFraction)],
    ["of an average view", percent(h.explainedArea)],
    ["seen through", percent(h.violatedFraction)],
    ["other surface", percent(h.unexplainedFraction)],
    ["residual", `${((h.residual ?? 0) * unit).toFixed(2)} mm`],
    ["votes", (h.votes ?? 0).toPrecision(3)],
    ["confidence", percent(h.confidence)],
  ];
  if (h.variants?.length) list.push(["could also lie", `as outlined (${h.variants.length})`]);
  if (h.occludedBy?.length) list.push(["take first", h.occludedBy.map((other) => `#${other + 1}`).join(" ")]);
  return list;
}
