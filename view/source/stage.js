// Canvas, camera and how one moves: orbit about a place on the ground, or fly.
import { Box3, PerspectiveCamera, Scene, Spherical, Vector2, Vector3, WebGLRenderer } from 'three';
import { MapControls } from 'three/addons/controls/MapControls.js';

const SKY = '#dfe8ee';
const SKY_DARK = '#1d242b';
const FOV_DEG = 45;
const KEYS = { KeyW: [0, 0, -1], KeyS: [0, 0, 1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0] };
const LAYERS_PX = 240;
const NARROW_PX = 760;
const LOOK_PER_PIXEL = 0.003;

export class Stage {
  /** @param {HTMLCanvasElement} canvas  @param {number[]} bounds e0, n0, u0, e1, n1, u1 of the city */
  constructor(canvas, bounds) {
    this.canvas = canvas;
    this.box = new Box3(new Vector3(...bounds.slice(0, 3)), new Vector3(...bounds.slice(3)));
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    const isDark = window.matchMedia?.('(prefers-color-scheme: dark)').matches;
    this.renderer.setClearColor(isDark ? SKY_DARK : SKY);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FOV_DEG, 1, 1, 1e4);
    this.camera.up.set(0, 0, 1);
    this.controls = new MapControls(this.camera, canvas);
    Object.assign(this.controls, { maxPolarAngle: Math.PI * 0.495, minDistance: 2, maxDistance: 2e4, zoomToCursor: true, dampingFactor: 0.15 });
    this.controls.listenToKeyEvents(canvas);
    this.controls.keyPanSpeed = 30;
    this.beforeFrame = [];
    this.afterMove = [];
    this.frames = 0;
    this.isFlying = false;
    this.pressed = new Set();
    this.isWaiting = false;
    this.changed = () => this.#changed();
    this.controls.addEventListener('change', () => this.#moved());
    this.#listen();
    this.resize();
    this.overview();
  }

  /** The whole city, seen from the south. */
  overview() {
    const middle = this.box.getCenter(new Vector3());
    const size = this.box.getSize(new Vector3());
    const away = 0.75 * Math.max(size.x, size.y, 40) + size.z;
    this.look([middle.x, middle.y - away * 0.8, middle.z + away * 0.75], [middle.x, middle.y, this.box.min.z]);
  }

  /** Stand at `from`, and look at `at`. */
  look(from, at) {
    this.camera.position.set(...from);
    this.controls.target.set(...at);
    this.camera.lookAt(this.controls.target);
    if (!this.isFlying) this.controls.update();
    this.#moved();
  }

  /** Come close to a place, from where one looks now. */
  approach(place, distance) {
    const back = this.camera.position.clone().sub(this.controls.target).setLength(distance);
    if (back.z < 0.35 * distance) back.setZ(0.5 * distance).setLength(distance);
    this.look(back.add(place).toArray(), place.toArray());
  }

  /** Camera and what it looks at, six numbers to the centimetre. */
  get place() {
    return [...this.camera.position.toArray(), ...this.#ahead().toArray()].map((v) => Math.round(v * 100) / 100);
  }

  fly(isFlying) {
    if (isFlying === this.isFlying) return;
    if (!isFlying) this.controls.target.copy(this.#ahead());
    this.isFlying = isFlying;
    this.controls.enabled = !isFlying;
    this.pressed.clear();
    if (!isFlying) this.controls.update();
    this.#moved();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    // the middle of what the layers leave free, not of the window
    this.camera.setViewOffset(width, height, width > NARROW_PX ? -LAYERS_PX / 2 : 0, 0, width, height);
    this.changed();
  }

  /** Normalised device coordinates of a pointer event. */
  ndc({ clientX, clientY }) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return new Vector2(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
  }

  /** Device coordinates of what one looks at. */
  get middle() {
    const { x, y } = this.#ahead().project(this.camera);
    return new Vector2(x, y);
  }

  /** Where a place is drawn, in pixels of the page; null behind the camera. */
  onPage(place) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const v = place.clone().project(this.camera);
    return v.z > 1 ? null : [left + ((v.x + 1) / 2) * width, top + ((1 - v.y) / 2) * height];
  }

  render() {
    this.camera.updateMatrixWorld();
    for (const step of this.beforeFrame) step();
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
  }

  #ahead() {
    if (!this.isFlying) return this.controls.target.clone();
    const reach = this.camera.position.distanceTo(this.controls.target);
    return this.camera.getWorldDirection(new Vector3()).multiplyScalar(Math.max(reach, 20)).add(this.camera.position);
  }

  #changed() {
    if (this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame((now) => {
      this.isWaiting = false;
      if (this.isFlying && this.pressed.size) this.#flyOn(now);
      else this.flownAt = null;
      this.render();
    });
  }

  #moved() {
    const away = this.camera.position.distanceTo(this.box.getCenter(new Vector3()));
    const reach = this.box.getSize(new Vector3()).length();
    const near = this.isFlying ? 1 : this.camera.position.distanceTo(this.controls.target);
    this.camera.near = Math.min(Math.max(near / 50, 0.2), 20);
    this.camera.far = away + reach + 2000;
    this.camera.updateProjectionMatrix();
    for (const step of this.afterMove) step();
    this.changed();
  }

  #flyOn(now) {
    const seconds = this.flownAt ? Math.min((now - this.flownAt) / 1000, 0.1) : 0.016;
    this.flownAt = now;
    const way = new Vector3();
    for (const key of this.pressed) way.add(new Vector3(...KEYS[key]));
    const speed = Math.max(8, 0.5 * (this.camera.position.z - this.box.min.z)) * (this.isFast ? 4 : 1);
    this.camera.position.add(way.applyQuaternion(this.camera.quaternion).setLength(speed * seconds));
    this.#moved();
  }

  #listen() {
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    this.canvas.addEventListener('keydown', (event) => {
      if (!this.isFlying || !(event.code in KEYS) || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      this.isFast = event.shiftKey;
      this.pressed.add(event.code);
      this.changed();
    });
    window.addEventListener('keyup', (event) => this.pressed.delete(event.code));
    window.addEventListener('blur', () => this.pressed.clear());
    let last = null;
    this.canvas.addEventListener('pointerdown', (event) => {
      if (this.isFlying) last = [event.clientX, event.clientY];
    });
    window.addEventListener('pointerup', () => (last = null));
    window.addEventListener('pointermove', (event) => {
      if (!last || !this.isFlying) return;
      this.#turn(event.clientX - last[0], event.clientY - last[1]);
      last = [event.clientX, event.clientY];
    });
  }

  /** Turn the head: about the vertical, and up or down short of it. */
  #turn(dx, dy) {
    const ahead = this.camera.getWorldDirection(new Vector3());
    const turned = new Spherical().setFromCartesianCoords(ahead.y, ahead.z, ahead.x);
    turned.theta += dx * LOOK_PER_PIXEL;
    turned.phi = Math.min(Math.max(turned.phi - dy * LOOK_PER_PIXEL, 0.05), Math.PI - 0.05);
    const [y, z, x] = new Vector3().setFromSpherical(turned).toArray();
    this.camera.lookAt(this.camera.position.clone().add(new Vector3(x, y, z)));
    this.#moved();
  }
}
