// Draws one or two models with one camera. Knows no files, and of the web page only its canvas.
import { Difference, SCALES } from './difference.js';
import { environmentOf } from './materials.js';
import {
  AnimationMixer,
  Box3,
  Color,
  DirectionalLight,
  MeshBasicMaterial,
  NeutralToneMapping,
  OrbitControls,
  PerspectiveCamera,
  PMREMGenerator,
  Scene,
  Vector3,
  WebGLRenderer,
} from './vendor.js';

const FIELD_OF_VIEW = 35; // degrees
const FIRST_VIEW = new Vector3(0.55, 0.35, 1).normalize(); // from the model to the camera
const MARGIN = 1.02; // of the picture around a model that fits
const MOST_PIXELS = 2; // per CSS pixel: more cost time and show little
const NEAREST = 1e-3; // of the radius of what is shown
const EDGE_OFFSET = 1e-4; // of the depths 0 to 1: edges are drawn so much before their triangles
const AMBIENT = 0.5; // brightness around the models: white stays below white
const KEY_BRIGHTNESS = 2.2;
const TURN = 0.4; // radians a second, of the turntable
const KEY_LIGHT = new Vector3(-1, 1, 0.7); // from the target, in the camera's directions

// The next frame is drawn as `wireframe` and `playing` say.
export class Stage {
  wireframe = false;
  playing = false;
  compare = 'beside'; // of two models: beside, wipe, distance or normal
  wipe = 0.5; // where the second one begins
  turns = false; // as on a turntable
  #canvas;
  #renderer;
  #camera = new PerspectiveCamera(FIELD_OF_VIEW);
  #controls;
  #environment = 'studio';
  #lights; // what it looks like from the models: a render target
  #lightAngle = 0;
  #difference = null;
  #edges = new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.6 });
  #panes = []; // {scene, light, mixer, model}: one, or two side by side
  #box = new Box3();
  #requested = false;
  #time = 0; // of the animations, in seconds
  #last = 0; // when a frame was drawn last, in milliseconds
  #fitted = false; // nobody has moved the camera since it was fitted

  // Throws an Error if the browser has no WebGL 2.
  constructor(canvas) {
    this.#canvas = canvas;
    try {
      this.#renderer = new WebGLRenderer({ canvas, antialias: true });
    } catch {
      throw new Error('this browser cannot draw: it has no WebGL 2, or it is switched off');
    }
    this.#renderer.toneMapping = NeutralToneMapping;
    this.#renderer.info.autoReset = false;
    this.#light();
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.#controls.dampingFactor = 0.12;
    this.#controls.zoomToCursor = true;
    this.#controls.addEventListener('change', () => this.invalidate());
    this.#controls.addEventListener('start', () => (this.#fitted = false));
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
  }

  // Shows models, {root, clips, box, update}: none, one, or two side by side. update, if there is
  // one: called before each frame with the camera and the renderer.
  show(models) {
    if (models.length === 0) this.#time = 0;
    this.#panes = models.map((model) => {
      const { root, clips } = model;
      const scene = new Scene();
      scene.environment = this.#lights.texture;
      scene.environmentIntensity = AMBIENT;
      scene.environmentRotation.y = this.#lightAngle;
      const light = new DirectionalLight(0xffffff, KEY_BRIGHTNESS);
      scene.add(root, light, light.target);
      const mixer = clips.length > 0 ? new AnimationMixer(root) : null;
      mixer?.clipAction(clips[0]).play();
      mixer?.setTime(this.#time);
      return { scene, light, mixer, model };
    });
    this.#box = models.reduce((all, { box }) => all.union(box), new Box3());
    if (this.#fitted) this.fit();
    this.invalidate();
  }

  // Draws what lights the models.
  #light() {
    const generator = new PMREMGenerator(this.#renderer);
    this.#lights?.dispose();
    const scene = environmentOf(this.#environment);
    this.#lights = generator.fromScene(scene, 0.04);
    generator.dispose();
    for (const { geometry, material } of /** @type {any[]} */ (scene.children)) {
      geometry.dispose();
      material.dispose();
    }
    for (const pane of this.#panes) pane.scene.environment = this.#lights.texture;
  }

  // environment: of ENVIRONMENTS; angle: where its light comes from.
  setLight(environment, angle) {
    if (environment !== this.#environment) {
      this.#environment = environment;
      this.#light();
    }
    this.#lightAngle = angle;
    for (const { scene } of this.#panes) scene.environmentRotation.y = angle;
    this.invalidate();
  }

  // After a lost WebGL context: three.js uploads again what it has not drawn itself. Forgets the
  // colours.
  restore() {
    this.#lights = null; // of the context that is lost
    this.#light();
    this.invalidate();
  }

  get animated() {
    return this.#panes.some(({ mixer }) => mixer);
  }

  // background and edges: colours of CSS.
  setColours(background, edges) {
    this.#renderer.setClearColor(new Color(background));
    this.#edges.color.set(edges);
    this.invalidate();
  }

  // Two panes lie side by side, in a tall window one above the other.
  get stacked() {
    return this.#canvas.clientHeight > this.#canvas.clientWidth;
  }

  // Looks at all of the models, from where the camera is or, with `first`, from the first view.
  fit(first = false) {
    if (this.#box.isEmpty()) return;
    const direction = first
      ? FIRST_VIEW.clone()
      : this.#camera.position.clone().sub(this.#controls.target).normalize();
    const centre = this.#box.getCenter(new Vector3());
    this.#camera.position.copy(centre).add(direction);
    this.#camera.lookAt(centre);
    this.#camera.updateMatrixWorld();
    const [right, up] = [0, 1].map((c) =>
      new Vector3().setFromMatrixColumn(this.#camera.matrixWorld, c),
    );
    const vertical = Math.tan(((FIELD_OF_VIEW / 2) * Math.PI) / 180);
    const { width, height } = this.#viewport(0);
    const horizontal = (vertical * width) / height;
    // How far the corners of the box reach over each of the four sides of the view.
    const half = this.#box.getSize(new Vector3()).divideScalar(2);
    const sides = [horizontal, -horizontal].map((slope) => right.clone().divideScalar(slope));
    sides.push(...[vertical, -vertical].map((slope) => up.clone().divideScalar(slope)));
    const distances = sides.map((side) => {
      const { x, y, z } = side.multiplyScalar(MARGIN).add(direction);
      return half.dot(new Vector3(Math.abs(x), Math.abs(y), Math.abs(z)));
    });
    const distance = Math.max(...distances, Number.MIN_VALUE);
    this.#camera.position.copy(centre).addScaledVector(direction, distance);
    this.#controls.target.copy(centre);
    this.#controls.maxDistance = 20 * distance;
    this.#controls.minDistance = NEAREST * distance;
    this.#controls.update();
    this.#fitted = true;
    this.invalidate();
  }

  // Angles in radians.
  orbit(left, up) {
    this.#fitted = false;
    this.#controls.rotateLeft(left);
    this.#controls.rotateUp(up);
  }

  // In pixels.
  pan(x, y) {
    this.#fitted = false;
    this.#controls.pan(x, y);
  }

  // Above 1: closer.
  zoom(factor) {
    this.#fitted = false;
    this.#controls.zoomToCursor = false; // there is no cursor to zoom to
    this.#controls.dollyIn(1 / factor);
    this.#controls.zoomToCursor = true;
  }

  invalidate() {
    if (this.#requested) return;
    this.#requested = true;
    requestAnimationFrame((now) => {
      this.#requested = false;
      this.#controls.update();
      this.#advance(now);
      this.#draw();
    });
  }

  // Draws at once and waits for the graphics card. Returns milliseconds.
  drawNow() {
    const start = performance.now();
    this.#draw();
    const gl = this.#renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // finish() may not wait
    return performance.now() - start;
  }

  // A picture of what is drawn, as a PNG.
  async picture() {
    this.#draw();
    const blob = await new Promise((resolve) => this.#canvas.toBlob(resolve));
    if (!blob) throw new Error('the picture cannot be saved');
    return blob;
  }

  #resize() {
    const { clientWidth, clientHeight } = this.#canvas;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXELS));
    this.#renderer.setSize(Math.max(clientWidth, 1), Math.max(clientHeight, 1), false);
    if (this.#fitted) this.fit();
    this.#draw(); // in the same frame: a resized canvas is empty
  }

  #advance(now) {
    const passed = Math.min(now - this.#last, 100); // a pause does not count
    this.#last = now;
    if (this.turns) {
      this.#controls.rotateLeft((TURN * passed) / 1000);
      this.invalidate();
    }
    if (!this.playing || !this.animated) return;
    this.#time += passed / 1000;
    for (const { mixer } of this.#panes) mixer?.setTime(this.#time);
    this.invalidate();
  }

  // In CSS pixels from the lower left.
  #viewport(pane) {
    const { clientWidth, clientHeight } = this.#canvas;
    const count = this.#isBeside ? this.#panes.length : 1;
    const width = this.stacked ? clientWidth : clientWidth / count;
    const height = this.stacked ? clientHeight / count : clientHeight;
    const x = this.stacked || count === 1 ? 0 : pane * width;
    const y = this.stacked && count > 1 ? (count - 1 - pane) * height : 0;
    return { x, y, width: Math.max(width, 1), height: Math.max(height, 1) };
  }

  get #isBeside() {
    return this.#panes.length > 1 && this.compare === 'beside';
  }

  #draw() {
    const renderer = this.#renderer;
    renderer.info.reset();
    renderer.setScissorTest(false);
    renderer.clear();
    const differs = this.#panes.length > 1 && this.compare in SCALES;
    this.#panes.forEach(({ scene, light, model }, pane) => {
      const { x, y, width, height } = this.#viewport(pane);
      renderer.setViewport(x, y, width, height);
      this.#frame(width / height);
      light.target.position.copy(this.#controls.target);
      light.position
        .copy(KEY_LIGHT)
        .transformDirection(this.#camera.matrixWorld)
        .applyAxisAngle(this.#camera.up, this.#lightAngle)
        .add(this.#controls.target);
      model.update?.(this.#camera, renderer);
      if (differs) return;
      this.#scissor(pane, x, y, width, height);
      renderer.render(scene, this.#camera);
      if (this.wireframe) this.#drawEdges(scene);
    });
    if (differs) this.#drawDifference();
  }

  // A pane has its viewport, or with the wipe its side of that.
  #scissor(pane, x, y, width, height) {
    const at = this.#panes.length > 1 && !this.#isBeside ? width * this.wipe : width;
    this.#renderer.setScissorTest(true);
    if (this.#isBeside || pane === 0) this.#renderer.setScissor(x, y, at, height);
    else this.#renderer.setScissor(at, y, width - at, height);
  }

  #drawDifference() {
    this.#difference ??= new Difference();
    let isFlat = false;
    const scenes = this.#panes.map(({ scene }) => scene);
    for (const scene of scenes)
      scene.traverse(({ geometry }) => {
        isFlat ||= geometry !== undefined && !geometry.attributes.normal;
      });
    const size = this.#box.getSize(new Vector3()).length();
    const options = { kind: this.compare, size, isFlat };
    this.#difference.draw(this.#renderer, this.#camera, scenes, options);
  }

  // The camera's frustum, around the models.
  #frame(aspect) {
    const centre = this.#box.getCenter(new Vector3());
    const radius = this.#box.getSize(new Vector3()).length() / 2 || 1;
    const distance = this.#camera.position.distanceTo(centre);
    this.#camera.aspect = aspect;
    this.#camera.near = Math.max(distance - 1.5 * radius, NEAREST * radius);
    this.#camera.far = distance + 1.5 * radius;
    this.#camera.updateProjectionMatrix();
    this.#camera.updateMatrixWorld();
  }

  #drawEdges(scene) {
    // Element 10 of the projection times -z adds to the depth.
    this.#camera.projectionMatrix.elements[10] += EDGE_OFFSET;
    this.#renderer.autoClear = false;
    scene.overrideMaterial = this.#edges;
    this.#renderer.render(scene, this.#camera);
    scene.overrideMaterial = null;
    this.#renderer.autoClear = true;
  }
}
