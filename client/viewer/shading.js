// How surfaces are lit: by the sky, which is where the stage's pole points, and by a lamp beside the camera. All faces are
// flat, so that the light of a face is the light of its corners and costs nothing a pixel; without a graphics card that is
// most of the time of a picture.
import * as THREE from "three";

const VERTEX = `
  flat varying vec3 light;
  uniform vec3 pole;
  const vec3 LAMP = vec3(-0.2989, 0.427, 0.8539);
  const vec3 SKY = vec3(0.4775);
  const vec3 GROUND = vec3(0.05, 0.064, 0.085);
  void main() {
    vec4 at = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * at;
    vec3 n = normalize(normalMatrix * normal);
    if (dot(n, at.xyz) > 0.0) n = -n; // a face seen from behind
    vec3 up = mat3(viewMatrix) * pole;
    light = mix(GROUND, SKY, 0.5 + 0.5 * dot(n, up)) + 0.7 * max(dot(n, LAMP), 0.0);
    #ifdef USE_COLOR
      light *= color;
    #endif
  }`;
const FRAGMENT = `
  flat varying vec3 light;
  uniform vec3 colour;
  uniform float glow;
  uniform float opacity;
  void main() {
    gl_FragColor = vec4((light + glow) * colour, opacity);
    #include <colorspace_fragment>
  }`;

/** A material of one colour, or of a colour for each vertex; `options` are those of every material. */
export class FlatMaterial extends THREE.ShaderMaterial {
  constructor(pole, { colour = "#ffffff", ...options }) {
    super({ vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide, ...options,
      uniforms: { pole: { value: pole }, colour: { value: new THREE.Color(colour) }, glow: { value: 0 }, opacity: { value: 1 } } });
  }

  /** Shines by that share of its own colour. */
  set glow(share) {
    this.uniforms.glow.value = share;
  }

  /** 1 is opaque. */
  fade(opacity) {
    this.transparent = opacity < 1;
    this.uniforms.opacity.value = opacity;
  }
}
