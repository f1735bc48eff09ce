// What colours say. Both scales run from dark or warm (little) to bright or cool (much), and are told apart without red and green.
import * as THREE from "three";

const SCORE = [[0.3, "#e8562a"], [0.5, "#f5b02e"], [0.65, "#c3d14f"], [0.8, "#2fbf9b"], [1, "#4aa8ff"]];
const OBSERVABILITY = [[0, "#3b1c5a"], [0.13, "#7a2a7a"], [0.26, "#c8446a"], [0.38, "#f58a4b"], [0.5, "#fbe38c"]];

function onScale(stops, value) {
  const next = stops.findIndex(([at]) => value <= at);
  if (next === 0) return new THREE.Color(stops[0][1]);
  if (next < 0) return new THREE.Color(stops.at(-1)[1]);
  const [[low, from], [high, to]] = [stops[next - 1], stops[next]];
  return new THREE.Color(from).lerp(new THREE.Color(to), (value - low) / (high - low));
}

export const scoreColour = (score) => onScale(SCORE, score);
/** Half of all viewpoints is the most that a point on a closed surface can be seen from. */
export const observabilityColour = (share) => onScale(OBSERVABILITY, share);
export const gradientOf = (colour, low, high) =>
  `linear-gradient(90deg,${[0, 0.25, 0.5, 0.75, 1].map((t) => colour(low + t * (high - low)).getStyle()).join(",")})`;
