// From the API's JSON to numbers. All lengths become millimetres.
import * as THREE from "three";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { PCDLoader } from "three/addons/loaders/PCDLoader.js";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import { STLLoader } from "three/addons/loaders/STLLoader.js";

export function bytesOf(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64 ?? "");
  const text = atob(base64 ?? "");
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

export const floatsOf = (base64) => new Float32Array(bytesOf(base64).buffer);

export function millimetresPer(unit) {
  return unit === "LENGTH_UNIT_METRE" ? 1000 : 1;
}

export function vectorOf({ x = 0, y = 0, z = 0 } = {}, scale = 1) {
  return new THREE.Vector3(x, y, z).multiplyScalar(scale);
}

/** T_scene_model as a matrix. */
export function matrixOf(pose, scale) {
  const { x = 0, y = 0, z = 0, w = 0 } = pose.orientation ?? {};
  const rotation = new THREE.Quaternion(x, y, z, w).normalize();
  return new THREE.Matrix4().compose(vectorOf(pose.position, scale), rotation, new THREE.Vector3(1, 1, 1));
}

/** Points x y z of a PointCloud, without those that were not measured; `columns` of an organised one, else 0. */
export function cloudOf(cloud) {
  const scale = millimetresPer(cloud.unit);
  if (cloud.depth) return depthPoints(cloud.depth, scale);
  if (cloud.points) {
    const columns = cloud.points.height > 1 ? cloud.points.width : 0;
    return { xyz: floatsOf(cloud.points.xyz).map((v) => v * scale), columns };
  }
  const bytes = bytesOf(cloud.ply ?? cloud.pcd).buffer;
  const geometry = cloud.ply ? new PLYLoader().parse(bytes) : new PCDLoader().parse(bytes).geometry;
  return { xyz: Float32Array.from(geometry.attributes.position.array, (v) => v * scale), columns: 0 };
}

function depthPoints(depth, scale) {
  const values = depth.uint16 ? new Uint16Array(bytesOf(depth.uint16).buffer) : floatsOf(depth.float32);
  const { fx, fy, cx = 0, cy = 0 } = depth.intrinsics;
  const xyz = new Float32Array(3 * values.length);
  for (let i = 0; i < values.length; ++i) {
    const z = values[i] > 0 ? values[i] * (depth.depthScale ?? 1) * scale : NaN;
    xyz[3 * i] = (((i % depth.width) - cx) * z) / fx;
    xyz[3 * i + 1] = ((Math.floor(i / depth.width) - cy) * z) / fy;
    xyz[3 * i + 2] = z;
  }
  return { xyz, columns: depth.width };
}

/** Radius of a disc, in diameters: model points are 0.015 apart or somewhat more, and discs shall leave no gaps. */
export const DISC_RADIUS = 0.0165;

/** A part's surface in the model frame, flat shaded: its mesh where there is one, else a disc for each model point. */
export function surfaceOf({ mesh, shape, model }) {
  if (mesh) return meshGeometry(bytesOf(mesh.data), millimetresPer(mesh.unit));
  return discs(floatsOf(shape.surface), floatsOf(shape.normals), DISC_RADIUS * 1000 * model.diameter);
}

function meshGeometry(bytes, scale) {
  const head = new TextDecoder("latin1").decode(bytes.subarray(0, 512));
  let geometry;
  if (head.startsWith("ply")) geometry = new PLYLoader().parse(bytes.buffer);
  else if (isStl(bytes, head)) geometry = new STLLoader().parse(bytes.buffer);
  else geometry = objGeometry(new TextDecoder().decode(bytes));
  if (geometry.index) geometry = geometry.toNonIndexed();
  geometry.scale(scale, scale, scale);
  geometry.computeVertexNormals(); // of each triangle its own
  return geometry;
}

function isStl(bytes, head) {
  if (bytes.length >= 84 && 84 + 50 * new DataView(bytes.buffer).getUint32(80, true) === bytes.length) return true;
  return head.trimStart().startsWith("solid");
}

function objGeometry(text) {
  const positions = [];
  new OBJLoader().parse(text).traverse((child) => {
    if (child.isMesh) for (const v of child.geometry.attributes.position.array) positions.push(v);
  });
  return new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
}

/** One hexagon of that radius across the normal of each point. Points are metres; `radius` is millimetres. */
export function discs(points, normals, radius) {
  const count = points.length / 3;
  const kCorners = 6;
  const position = new Float32Array(count * kCorners * 3);
  const normal = new Float32Array(count * kCorners * 3);
  const index = [];
  const n = new THREE.Vector3(), a = new THREE.Vector3(), b = new THREE.Vector3();
  for (let i = 0; i < count; ++i) {
    n.fromArray(normals, 3 * i);
    a.set(...(Math.abs(n.x) < 0.6 ? [1, 0, 0] : [0, 1, 0])).cross(n).setLength(radius);
    b.copy(n).cross(a);
    for (let k = 0; k < kCorners; ++k) {
      const [c, s] = [Math.cos((2 * k * Math.PI) / kCorners), Math.sin((2 * k * Math.PI) / kCorners)];
      const at = 3 * (kCorners * i + k);
      position[at] = 1000 * points[3 * i] + c * a.x + s * b.x;
      position[at + 1] = 1000 * points[3 * i + 1] + c * a.y + s * b.y;
      position[at + 2] = 1000 * points[3 * i + 2] + c * a.z + s * b.z;
      n.toArray(normal, at);
      if (k > 1) index.push(kCorners * i, kCorners * i + k - 1, kCorners * i + k);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(normal, 3));
  geometry.setIndex(index);
  geometry.userData.cornersPerPoint = kCorners;
  return geometry;
}
