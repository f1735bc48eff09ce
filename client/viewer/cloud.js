// The scan as shaded points.
import * as THREE from "three";

const SAMPLES = 20000; // points that tell the extent of all
const TINT = [0.3, 0.36, 0.44];

/** Points of a cloud as wire.js gives it, with their middle and radius in `userData`. A part's surface hides those that
 * lie less than `tolerance` in front of it: they are the measured part itself. */
export function cloudPoints(stage, cloud, sensor, tolerance) {
  const { xyz } = cloud;
  const kept = measured(xyz);
  const shade = cloud.columns > 1 ? shadeBySlope(cloud, sensor) : shadeByDepth(xyz, kept, sensor);
  const position = new Float32Array(3 * kept.length);
  const colour = new Float32Array(3 * kept.length);
  for (let to = 0; to < kept.length; ++to) {
    const from = kept[to];
    const brightness = shade(from);
    for (let k = 0; k < 3; ++k) {
      position[3 * to + k] = xyz[3 * from + k];
      colour[3 * to + k] = TINT[k] * brightness;
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(colour, 3));
  const { centre, radius, spacing } = extentOf(position);
  const material = new THREE.PointsMaterial({ size: stage.pointSize(spacing), vertexColors: true });
  setBack(material, tolerance);
  const points = new THREE.Points(geometry, material);
  Object.assign(points.userData, { centre, radius });
  return points;
}

/** Indices of the points with three finite coordinates. */
function measured(xyz) {
  const kept = new Uint32Array(xyz.length / 3);
  let count = 0;
  for (let i = 0; i < kept.length; ++i) {
    if (Number.isFinite(xyz[3 * i] + xyz[3 * i + 1] + xyz[3 * i + 2])) kept[count++] = i;
  }
  return kept.subarray(0, count);
}

/** Draws points that much farther away than they are, at the same place of the picture. */
function setBack(material, millimetres) {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>
      mvPosition.xyz += ${millimetres.toFixed(3)} * normalize(mvPosition.xyz);
      gl_Position = projectionMatrix * mvPosition;`);
  };
}

/** Of an organised cloud: bright where the surface faces the sensor. */
function shadeBySlope({ xyz, columns }, sensor) {
  const [here, right, below, n] = Array.from({ length: 4 }, () => new THREE.Vector3());
  return (i) => {
    here.fromArray(xyz, 3 * i);
    right.fromArray(xyz, 3 * (i + 1)).sub(here);
    below.fromArray(xyz, 3 * (i + columns)).sub(here);
    n.crossVectors(right, below).normalize();
    const facing = Math.abs(n.dot(here.sub(sensor).normalize()));
    return Number.isFinite(facing) ? 0.12 + 0.75 * facing ** 1.5 : 0.3;
  };
}

/** Of an unordered cloud: bright where it is near. */
function shadeByDepth(xyz, kept, sensor) {
  const at = new THREE.Vector3();
  const depth = (i) => at.fromArray(xyz, 3 * i).distanceTo(sensor);
  const step = Math.max(1, Math.floor(kept.length / SAMPLES));
  const depths = Float64Array.from({ length: Math.ceil(kept.length / step) }, (_, i) => depth(kept[step * i])).sort();
  const [near, far] = [depths[Math.floor(0.02 * depths.length)], depths[Math.floor(0.98 * depths.length)]];
  return (i) => 0.9 - 0.65 * Math.min(1, Math.max(0, (depth(i) - near) / (far - near || 1)));
}

/** Middle and radius without the outermost points, and about how far apart neighbours are. */
function extentOf(position) {
  const count = position.length / 3;
  if (count === 0) return { centre: new THREE.Vector3(), radius: 100, spacing: 1 };
  const step = Math.max(1, Math.floor(count / SAMPLES));
  const [low, high] = [new THREE.Vector3(), new THREE.Vector3()];
  for (let axis = 0; axis < 3; ++axis) {
    const values = [];
    for (let i = 0; i < count; i += step) values.push(position[3 * i + axis]);
    values.sort((a, b) => a - b);
    low.setComponent(axis, values[Math.floor(0.01 * values.length)]);
    high.setComponent(axis, values[Math.ceil(0.99 * values.length) - 1]);
  }
  const size = high.clone().sub(low);
  const area = Math.max(size.x * size.y, size.y * size.z, size.z * size.x);
  return { centre: low.add(high).multiplyScalar(0.5), radius: size.length() / 2 || 1, spacing: Math.sqrt(area / count) || 1 };
}
