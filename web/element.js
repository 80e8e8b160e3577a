// <meshlet-view src="model.glb">: a glTF file in a web page, drawn by three.js. Files with levels of
// detail stream. It opens its file when it comes into view, and draws only what changes.
import {
  ACESFilmicToneMapping,
  Box3,
  PerspectiveCamera,
  PMREMGenerator,
  Scene,
  Sphere,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { MeshletStream } from './stream/three.js';

const FIELD_OF_VIEW = 35; // degrees
const TURN = Math.PI / 24; // of an arrow key
const MOST_PIXELS = 2; // per CSS pixel
const STYLE = `
  :host { display: block; aspect-ratio: 4 / 3; position: relative }
  :host([hidden]) { display: none }
  canvas { position: absolute; width: 100%; height: 100%; touch-action: none }
  p { position: absolute; inset: auto 8px 8px; margin: 0; overflow-wrap: anywhere }
`;
const TURNS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

// Attributes: src; alt, a text for those who do not see it; pixels and max-bytes, as the options of
// MeshletStream; turntable: it turns. Events: load, error {detail: Error}. Property: stream, of the file
// that opens or is open; null before it is seen.
export class MeshletView extends HTMLElement {
  static observedAttributes = ['src', 'alt', 'pixels', 'max-bytes', 'turntable'];
  stream = null;
  #renderer = null;
  #camera = new PerspectiveCamera(FIELD_OF_VIEW);
  #controls = null;
  #scene = new Scene();
  #observers = [];
  #isVisible = false;
  #requested = 0; // frame
  #message;

  constructor() {
    super();
    const root = this.attachShadow({ mode: 'open' });
    const style = document.createElement('style');
    style.textContent = STYLE;
    this.#message = document.createElement('p');
    root.append(style, this.#message);
    this.addEventListener('keydown', (event) => {
      const [left, up] = TURNS[event.key] ?? [];
      if (left === undefined || !this.#controls) return;
      this.#controls.rotateLeft(TURN * left);
      this.#controls.rotateUp(TURN * up);
      event.preventDefault();
    });
  }

  connectedCallback() {
    if (!this.hasAttribute('tabindex')) this.tabIndex = 0;
    this.setAttribute('role', 'img');
    const sight = new IntersectionObserver((entries) => {
      this.#isVisible = entries.at(-1).isIntersecting;
      if (this.#isVisible) this.#open();
    });
    const size = new ResizeObserver(() => this.#resize());
    sight.observe(this);
    size.observe(this);
    this.#observers = [sight, size];
  }

  disconnectedCallback() {
    for (const observer of this.#observers) observer.disconnect();
    this.#close();
    cancelAnimationFrame(this.#requested);
    this.#requested = 0;
    this.#controls?.dispose();
    this.#renderer?.dispose();
    this.#renderer?.forceContextLoss(); // browsers have a few contexts only
    this.#renderer?.domElement.remove();
    this.#renderer = null;
    this.#controls = null;
    this.#isVisible = false;
  }

  attributeChangedCallback(name, before, after) {
    if (name === 'alt') this.setAttribute('aria-label', after ?? '');
    if (name === 'src' && before !== after) {
      this.#close();
      if (this.#isVisible) this.#open();
    }
    if (!this.stream) return;
    if (name === 'pixels') this.stream.pixels = Number(after ?? 1);
    if (name === 'max-bytes' && after) this.stream.maxBytes = Number(after);
    this.#draw();
  }

  async #open() {
    const src = this.getAttribute('src');
    if (this.stream || !src) return;
    let stream = null;
    try {
      if (!this.#renderer) this.#start();
      const options = { pixels: Number(this.getAttribute('pixels') ?? 1) };
      if (this.hasAttribute('max-bytes')) options.maxBytes = Number(this.getAttribute('max-bytes'));
      stream = /** @type {any} */ (new MeshletStream(src, options));
      this.stream = stream;
      stream.addEventListener('progress', () => this.#draw());
      await stream.ready;
      if (stream !== this.stream) return;
      this.#scene.add(stream);
      this.#fit(stream);
      this.dispatchEvent(new Event('load'));
    } catch (error) {
      if (stream !== this.stream) return; // it has been closed
      this.#message.textContent = this.getAttribute('alt') || error.message;
      this.dispatchEvent(new CustomEvent('error', { detail: error }));
    }
  }

  #close() {
    this.#message.textContent = '';
    this.stream?.removeFromParent();
    this.stream?.dispose();
    this.stream = null;
    this.#draw();
  }

  #start() {
    this.#renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.#renderer.toneMapping = ACESFilmicToneMapping;
    this.shadowRoot.prepend(this.#renderer.domElement);
    this.#light();
    // three.js uploads again what it has not drawn itself.
    this.#renderer.domElement.addEventListener('webglcontextrestored', () => this.#light());
    this.#controls = new OrbitControls(this.#camera, this.#renderer.domElement);
    this.#controls.addEventListener('change', () => this.#draw());
    this.#resize();
  }

  #light() {
    const generator = new PMREMGenerator(this.#renderer);
    const room = new RoomEnvironment();
    this.#scene.environment = generator.fromScene(room, 0.04).texture;
    room.dispose();
    generator.dispose();
    this.#draw();
  }

  #fit(stream) {
    const { center, radius } = new Box3().setFromObject(stream).getBoundingSphere(new Sphere());
    const distance = radius / Math.sin((FIELD_OF_VIEW * Math.PI) / 360);
    this.#camera.near = radius / 1000;
    this.#camera.far = 100 * radius;
    this.#camera.position.set(0.45, 0.3, 0.85).normalize().multiplyScalar(distance).add(center);
    this.#controls.target.copy(center);
    this.#camera.updateProjectionMatrix();
    this.#controls.update();
    this.#draw();
  }

  #resize() {
    const { clientWidth, clientHeight } = this;
    if (!this.#renderer || clientWidth * clientHeight === 0) return;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXELS));
    this.#renderer.setSize(clientWidth, clientHeight, false);
    this.#camera.aspect = clientWidth / clientHeight;
    this.#camera.updateProjectionMatrix();
    this.#draw();
  }

  // In the next frame.
  #draw() {
    if (!this.#renderer || this.#requested) return;
    this.#requested = requestAnimationFrame(() => {
      this.#requested = 0;
      const turns = this.hasAttribute('turntable') && this.#isVisible;
      this.#controls.autoRotate = turns;
      this.#controls.update();
      this.stream?.update(this.#camera, this.#renderer);
      this.#renderer.render(this.#scene, this.#camera);
      if (turns) this.#draw();
    });
  }
}

if (!customElements.get('meshlet-view')) customElements.define('meshlet-view', MeshletView);
