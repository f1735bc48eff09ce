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
  const brightness = new Uint8Array(kept.length);
  for (let to = 0; to < kept.length; ++to) {
    const from = 3 * kept[to];
    position[3 * to] = xyz[from];
    position[3 * to + 1] = xyz[from + 1];
    position[3 * to + 2] = xyz[from + 2];
    brightness[to] = 255 * shade(kept[to]);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
  geometry.setAttribute("brightness", new THREE.BufferAttribute(brightness, 1, true));
  const { centre, radius, spacing } = extentOf(position);
  const material = pointsMaterial(stage, spacing, tolerance);
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

/** Of points that measure `spacing`, drawn `tolerance` farther away than they are, at the same place of the picture. */
function pointsMaterial(stage, spacing, tolerance) {
  const vertexShader = `
    attribute float brightness;
    flat varying vec3 light;
    uniform float pixels;
    void main() {
      vec3 at = (modelViewMatrix * vec4(position, 1.0)).xyz;
      gl_PointSize = ${spacing.toFixed(6)} * pixels / -at.z;
      gl_Position = projectionMatrix * vec4(at + ${tolerance.toFixed(3)} * normalize(at), 1.0);
      light = brightness * vec3(${TINT});
    }`;
  const fragmentShader = `
    flat varying vec3 light;
    void main() {
      gl_FragColor = vec4(light, 1.0);
      #include <colorspace_fragment>
    }`;
  return new THREE.ShaderMaterial({ vertexShader, fragmentShader, uniforms: { pixels: stage.pixels } });
}

/** Of an organised cloud: bright where the surface faces the sensor. Plain numbers: this runs for each point. */
function shadeBySlope({ xyz, columns }, sensor) {
  return (i) => {
    const here = 3 * i, right = here + 3, below = here + 3 * columns;
    const [x, y, z] = [xyz[here], xyz[here + 1], xyz[here + 2]];
    const [ax, ay, az] = [xyz[right] - x, xyz[right + 1] - y, xyz[right + 2] - z];
    const [bx, by, bz] = [xyz[below] - x, xyz[below + 1] - y, xyz[below + 2] - z];
    const [nx, ny, nz] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    const [dx, dy, dz] = [x - sensor.x, y - sensor.y, z - sensor.z];
    const lengths = Math.sqrt((nx * nx + ny * ny + nz * nz) * (dx * dx + dy * dy + dz * dz));
    const facing = Math.abs(nx * dx + ny * dy + nz * dz) / lengths;
    return Number.isFinite(facing) ? 0.12 + 0.75 * facing * Math.sqrt(facing) : 0.3;
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
    const values = Float32Array.from({ length: Math.ceil(count / step) }, (_, i) => position[3 * step * i + axis]).sort();
    low.setComponent(axis, values[Math.floor(0.01 * values.length)]);
    high.setComponent(axis, values[Math.ceil(0.99 * values.length) - 1]);
  }
  const size = high.clone().sub(low);
  const area = Math.max(size.x * size.y, size.y * size.z, size.z * size.x);
  return { centre: low.add(high).multiplyScalar(0.5), radius: size.length() / 2 || 1, spacing: Math.sqrt(area / count) || 1 };
}
