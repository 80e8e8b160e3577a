// Draws how far two models are apart, pixel by pixel: the distance of the surfaces that are seen, or the
// angle between their normals, in colours of a logarithmic scale.
import {
  FloatType,
  Mesh,
  MeshNormalMaterial,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  WebGLRenderTarget,
} from './vendor.js';

// Powers of ten at the ends of the scale: of the models' size, and of degrees.
export const SCALES = { distance: [-6, -2], normal: [-1, 2] };

const COLOURS = `
uniform sampler2D one, other;
uniform vec3 scale; // ends; distances are divided by the third, angles if it is 0
varying vec2 at;
void main() {
  vec4 p = texture2D(one, at), q = texture2D(other, at);
  if (p.w == 0. && q.w == 0.) discard;
  gl_FragColor = vec4(.35, .35, .35, 1.);
  if (p.w == 0. || q.w == 0.) return;
  float apart = scale.z > 0. ? abs(p.w - q.w) * abs(p.z) / scale.z
    : degrees(2. * asin(min(distance(p.xyz, q.xyz) / 2., 1.)));
  float t = clamp((log2(max(apart, 1e-9)) / log2(10.) - scale.x) / (scale.y - scale.x), 0., 1.);
  gl_FragColor.rgb = clamp(1.5 - abs(4. * t - vec3(3, 2, 1)), 0., 1.) * (.45 + .55 * abs(q.z));
}`;

export class Difference {
  #targets = [0, 1].map(() => new WebGLRenderTarget(1, 1, { type: FloatType }));
  #surface = new MeshNormalMaterial({ side: 2, blending: 0 }); // both sides, as it is
  #picture;
  #screen = new Scene();

  constructor() {
    this.#surface.onBeforeCompile = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace(
        /\}\s*$/,
        'gl_FragColor = vec4(normalize(normal), 1. / gl_FragCoord.w); }',
      );
    };
    const [one, other] = this.#targets.map(({ texture }) => ({ value: texture }));
    this.#picture = new ShaderMaterial({
      uniforms: { one, other, scale: { value: [0, 0, 0] } },
      vertexShader: 'varying vec2 at; void main() { at = uv; gl_Position = vec4(position, 1.); }',
      fragmentShader: COLOURS,
      depthTest: false,
    });
    const plane = new Mesh(new PlaneGeometry(2, 2), this.#picture);
    plane.frustumCulled = false;
    this.#screen.add(plane);
  }

  // kind: of SCALES; size: of the models; isFlat: one has no normals.
  draw(renderer, camera, scenes, { kind, size, isFlat }) {
    const { width, height } = renderer.domElement;
    if (this.#surface.flatShading !== isFlat) {
      this.#surface.flatShading = isFlat;
      this.#surface.needsUpdate = true;
    }
    renderer.setClearAlpha(0);
    scenes.forEach((scene, i) => {
      this.#targets[i].setSize(width, height);
      renderer.setRenderTarget(this.#targets[i]);
      renderer.clear();
      scene.overrideMaterial = this.#surface;
      renderer.render(scene, camera);
      scene.overrideMaterial = null;
    });
    renderer.setRenderTarget(null);
    renderer.setClearAlpha(1);
    this.#picture.uniforms.scale.value = [...SCALES[kind], kind === 'distance' ? size : 0];
    renderer.render(this.#screen, camera);
  }
}
