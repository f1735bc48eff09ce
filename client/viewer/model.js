// A model: its surface coloured by observability, its vector pairs, its symmetry.
import * as THREE from "three";
import { gradientOf, observabilityColour } from "./colour.js";
import { addSwitch, element, facts, onKey, sayKeys, warn } from "./panel.js";
import { FlatMaterial } from "./shading.js";
import { Stage, frameLines, labelAt } from "./stage.js";
import { DISC_RADIUS, bytesOf, discs, floatsOf, matrixOf, vectorOf } from "./wire.js";

const PAIRS_AT_FIRST = 40;
const OBLIQUE = 62; // degrees off the z axis

export function showModel({ model, shape }) {
  const stage = new Stage({ pole: new THREE.Vector3(0, 0, 1), front: new THREE.Vector3(-0.55, -0.85, 0) });
  const diameter = 1000 * model.diameter;
  const centre = vectorOf(model.boundingBoxMin, 500).add(vectorOf(model.boundingBoxMax, 500));
  const surface = observabilityMap(shape, diameter, stage.pole);
  const pairs = pairLines(shape);
  const symmetry = symmetryLines(model, centre, diameter);
  const frame = frameLines(0.5 * diameter);
  stage.scene.add(surface, pairs, symmetry, frame);

  addSwitch(stage, "s", "Surface", surface);
  addSwitch(stage, "v", "Vector pairs", pairs);
  addSwitch(stage, "y", `Symmetry (${symmetry.children.length})`, symmetry);
  addSwitch(stage, "f", "Frame", frame);
  describe(stage, model, pairs, symmetry);

  const home = (tilt) => stage.look(centre, (symmetry.children.length ? 0.68 : 0.56) * diameter, tilt);
  onKey("0", () => home(0));
  onKey("1", () => home(OBLIQUE));
  onKey("ArrowLeft", () => stage.turn(-10));
  onKey("ArrowRight", () => stage.turn(10));
  sayKeys([["← →", "turn"], ["0", "from above"], ["1", "oblique"], ["s v y f", "show"]]);
  home(OBLIQUE);
}

function observabilityMap(shape, diameter, pole) {
  const geometry = discs(floatsOf(shape.surface), floatsOf(shape.normals), DISC_RADIUS * diameter);
  const shares = floatsOf(shape.observability);
  const corners = geometry.userData.cornersPerPoint;
  const colours = new Float32Array(3 * corners * shares.length);
  shares.forEach((share, i) => {
    const colour = observabilityColour(share);
    for (let k = 0; k < corners; ++k) colour.toArray(colours, 3 * (corners * i + k));
  });
  geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  return new THREE.Mesh(geometry, new FlatMaterial(pole, { vertexColors: true }));
}

/** Two lines a pair, P to Q1 and P to Q2, in the order of the pairs, so that the first n can be drawn alone. */
function pairLines(shape) {
  const points = floatsOf(shape.pairPoints);
  const pairs = new Uint32Array(bytesOf(shape.pairs).buffer);
  const position = new Float32Array(4 * pairs.length);
  const colour = new Float32Array(4 * pairs.length);
  const ends = [new THREE.Color("#ffffff"), new THREE.Color("#35d0ff")];
  for (let i = 0, at = 0; i < pairs.length; i += 3) {
    for (const q of [1, 2]) {
      for (const index of [pairs[i], pairs[i + q]]) {
        for (let axis = 0; axis < 3; ++axis) position[at + axis] = 1000 * points[3 * index + axis];
        ends[q - 1].toArray(colour, at);
        at += 3;
      }
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(colour, 3));
  const lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, depthTest: false }));
  lines.renderOrder = 1;
  lines.userData.count = pairs.length / 3;
  return lines;
}

/** An axis of revolution, and the axes of the turns that leave the part as it was, or nearly so. */
function symmetryLines({ symmetry = {}, similarPoses }, centre, diameter) {
  const lines = new THREE.Group();
  const add = ({ point, direction }, colour, name) => {
    const from = point.clone().addScaledVector(direction, direction.dot(centre.clone().sub(point)));
    const upwards = Math.sign(direction.z || direction.y || direction.x); // there the name stands
    const ends = [-0.6, 0.6].map((share) => from.clone().addScaledVector(direction, upwards * share * diameter));
    const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends),
      new THREE.LineDashedMaterial({ color: colour, dashSize: 0.04 * diameter, gapSize: 0.02 * diameter }));
    line.computeLineDistances();
    line.name = name;
    line.add(labelAt(ends[1], name, colour));
    lines.add(line);
  };
  if (symmetry.axis) {
    add({ point: vectorOf(symmetry.axis.point, 1000), direction: vectorOf(symmetry.axis.direction).normalize() }, "#ffd166", "any turn");
  }
  for (const axis of axesOf(symmetry.discrete, diameter)) add(axis, "#8ce99a", `${axis.degrees.length + 1}-fold`);
  for (const axis of axesOf(similarPoses, diameter)) {
    add(axis, "#ff9f68", `nearly, ${axis.degrees.map((angle) => `${angle.toFixed(0)}°`).join(" ")}`);
  }
  return lines;
}

/** The turns of a list of motions, by the axes that they share. */
function axesOf(poses, diameter) {
  const axes = [];
  for (const pose of poses ?? []) {
    const turn = turnOf(matrixOf(pose, 1000));
    if (!turn) continue;
    const isShared = ({ point, direction }) => Math.abs(direction.dot(turn.direction)) > 0.999 &&
      turn.point.clone().sub(point).cross(direction).length() < 0.02 * diameter;
    const axis = axes.find(isShared);
    if (!axis) axes.push({ ...turn, degrees: [turn.degrees] });
    else axis.degrees.push(axis.direction.dot(turn.direction) > 0 ? turn.degrees : 360 - turn.degrees);
  }
  for (const { degrees } of axes) degrees.sort((a, b) => a - b);
  return axes;
}

/** Axis and angle of a rigid motion; nothing for the identity. */
function turnOf(matrix) {
  const position = new THREE.Vector3(), rotation = new THREE.Quaternion(), scale = new THREE.Vector3();
  matrix.decompose(position, rotation, scale);
  if (rotation.w < 0) rotation.set(-rotation.x, -rotation.y, -rotation.z, -rotation.w);
  const direction = new THREE.Vector3(rotation.x, rotation.y, rotation.z);
  const sine = direction.length();
  if (sine < 1e-4) return null;
  direction.divideScalar(sine);
  const across = position.addScaledVector(direction, -position.dot(direction));
  const point = across.clone().addScaledVector(new THREE.Vector3().crossVectors(direction, across), rotation.w / sine);
  return { direction, point: point.multiplyScalar(0.5), degrees: (360 / Math.PI) * Math.asin(Math.min(1, sine)) };
}

function describe(stage, model, pairs, symmetry) {
  const size = vectorOf(model.boundingBoxMax, 1000).sub(vectorOf(model.boundingBoxMin, 1000));
  document.getElementById("summary").textContent = `model, generation ${model.generation}`;
  warn(model.warnings);
  const count = pairs.userData.count;
  const said = element("b", {});
  const slider = element("input", { type: "range", min: 0, max: 1000, id: "pair-count", "aria-label": "Vector pairs shown" });
  // From few to all: equal steps multiply.
  const draw = () => {
    const shown = Math.round((count + 1) ** (slider.value / 1000)) - 1;
    pairs.geometry.setDrawRange(0, 4 * shown);
    said.textContent = `the best ${shown} of ${count} vector pairs`;
    stage.render();
  };
  slider.value = 1000 * Math.log(PAIRS_AT_FIRST + 1) / Math.log(Math.max(count, 1) + 1);
  slider.addEventListener("input", draw);
  draw();
  const legend = element("div", { class: "legend" },
    element("i", { style: { background: gradientOf(observabilityColour, 0, 0.5) } }),
    element("span", {}, element("b", {}, "seen from no viewpoint"), element("b", {}, "half of them")));
  const list = document.getElementById("list");
  list.className = "model";
  list.append(legend, element("div", { class: "legend" }, slider, element("span", {}, said)), facts([
    ["diameter", `${(1000 * model.diameter).toFixed(1)} mm`],
    ["box", `${size.toArray().map((v) => v.toFixed(1)).join(" x ")} mm`],
    ["points", `${model.pointCount}`],
    ["vector pairs", `${model.pairCount}`],
    ["symmetry", countEach(symmetry.children.map((line) => line.name)) || "none"],
    ["content hash", model.contentHash],
  ]));
}

/** "6-fold, 2-fold x 6" of a list of names. */
function countEach(names) {
  const counts = new Map();
  for (const name of names) counts.set(name, (counts.get(name) ?? 0) + 1);
  return [...counts].map(([name, count]) => (count > 1 ? `${name} x ${count}` : name)).join("; ");
}
