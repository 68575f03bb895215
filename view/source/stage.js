// Canvas, camera and how one moves: orbit about a place on the ground, or fly.
import { Box3, MathUtils, PerspectiveCamera, Scene, Spherical, Vector2, Vector3, WebGLRenderer } from 'three';
import { MapControls } from 'three/addons/controls/MapControls.js';
import { fitted } from './overview.js';

const SKY = '#dfe8ee';
const SKY_DARK = '#1d242b';
const FOV_DEG = 45;
const KEYS = { KeyW: [0, 0, -1], KeyS: [0, 0, 1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0] };
const LOOK_PER_PIXEL = 0.003;
const GLIDE_MS = 450;
const ASIDE_MS = 200;
const RIM_PX = 40;
const MOST_DISTANCE_M = 2e4;

/** Width and height in pixels of the page. */
const sizeOf = ({ clientWidth, clientHeight }) => [Math.max(clientWidth, 1), Math.max(clientHeight, 1)];

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.box = new Box3(new Vector3(-100, -100, 0), new Vector3(100, 100, 10));
    this.corners = [];
    this.covered = { left: 0, right: 0, top: 0, bottom: 0 };
    this.glides = new Map();
    const wanted = { alpha: true, antialias: true, powerPreference: 'high-performance', stencil: false };
    this.size = sizeOf(canvas.parentElement);
    [canvas.width, canvas.height] = this.size;
    const context = canvas.getContext('webgl2', wanted);
    if (!context) throw new Error('no WebGL');
    this.renderer = new WebGLRenderer({ canvas, context, ...wanted });
    const isDark = window.matchMedia?.('(prefers-color-scheme: dark)').matches;
    this.renderer.setClearColor(isDark ? SKY_DARK : SKY);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FOV_DEG, 1, 1, 1e4);
    this.camera.up.set(0, 0, 1);
    this.controls = new MapControls(this.camera, canvas);
    Object.assign(this.controls, { maxPolarAngle: Math.PI * 0.495, minDistance: 2, maxDistance: MOST_DISTANCE_M, zoomToCursor: true, dampingFactor: 0.15 });
    this.controls.listenToKeyEvents(canvas);
    this.controls.keyPanSpeed = 30;
    this.beforeFrame = [];
    this.afterMove = [];
    this.frames = 0;
    this.isBlank = true;
    this.split = null;
    this.beside = null;
    this.isFlying = false;
    this.pressed = new Set();
    this.isWaiting = false;
    this.changed = () => this.#changed();
    this.controls.addEventListener('change', () => this.#moved());
    this.#listen();
    this.resize();
  }

  /** What there is to see: `bounds` e0, n0, u0, e1, n1, u1, and (x, y, z) corners that an overview must hold. */
  show(bounds, corners) {
    this.box.set(new Vector3(...bounds.slice(0, 3)), new Vector3(...bounds.slice(3)));
    this.corners = corners;
    this.controls.maxDistance = Math.max(MOST_DISTANCE_M, 3 * this.box.getSize(new Vector3()).length());
    this.overview(false);
  }

  /** The whole city, obliquely from the south or the west: as near as it fits beside the panels. */
  overview(isGliding = true) {
    const { from, at } = fitted(this.corners, this.box, this.camera, this.size, this.covered);
    if (isGliding) this.#glideTo(from, at);
    else this.look(from, at);
  }

  /** Stand at `from`, and look at `at`. */
  look(from, at) {
    this.glides.delete('look');
    this.#stand(from, at);
  }

  #stand(from, at) {
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
    this.#glideTo(back.add(place).toArray(), place.toArray());
  }

  /** Come nearer to a place that one looks at, or go back from it: the distance is multiplied by `factor`. */
  nearer(factor, place = this.controls.target) {
    if (this.isFlying) return;
    const way = this.camera.position.clone().sub(place);
    way.setLength(MathUtils.clamp(factor * way.length(), this.controls.minDistance, this.controls.maxDistance));
    this.look(way.add(place).toArray(), place.toArray());
  }

  #glideTo(from, at) {
    const [from0, at0] = [this.camera.position.clone(), this.#ahead()];
    const [from1, at1] = [new Vector3(...from), new Vector3(...at)];
    this.#glide('look', GLIDE_MS, (t) => this.#stand(from0.clone().lerp(from1, t).toArray(), at0.clone().lerp(at1, t).toArray()));
  }

  /** Do `step` with 0 < t ≤ 1, eased, frame by frame; at once for those who want no motion. */
  #glide(name, ms, step) {
    this.glides.delete(name);
    if (window.matchMedia?.('(prefers-reduced-motion: reduce)').matches) return step(1);
    this.glides.set(name, { begun: performance.now(), ms, step });
    return this.changed();
  }

  #glideOn() {
    for (const [name, { begun, ms, step }] of [...this.glides]) {
      const t = Math.min((performance.now() - begun) / ms, 1);
      if (t >= 1) this.glides.delete(name);
      step(t * t * (3 - 2 * t));
    }
    if (this.glides.size) this.changed();
  }

  get isGliding() {
    return this.glides.size > 0;
  }

  /** How many pixels of each side stand under panels: what one looks at is in the middle of the rest. */
  coverBy(covered, isAtOnce = false) {
    const names = Object.keys(this.covered);
    if (names.every((name) => Math.abs((this.aim ?? this.covered)[name] - covered[name]) < 1)) return;
    this.aim = covered;
    const before = { ...this.covered };
    const step = (t) => {
      for (const name of names) this.covered[name] = MathUtils.lerp(before[name], covered[name], t);
      this.#aside();
    };
    if (isAtOnce) step(1);
    else this.#glide('aside', ASIDE_MS, step);
  }

  /** Move so that a place is in the middle of what no panel covers, unless it is seen there anyway. */
  uncover(place) {
    const at = this.onPage(place);
    const { left, right, top, bottom } = this.aim ?? this.covered;
    const { left: x0, top: y0 } = this.canvas.getBoundingClientRect();
    const [dx, dy] = [(left - right - this.covered.left + this.covered.right) / 2, (top - bottom - this.covered.top + this.covered.bottom) / 2];
    const [x, y] = at ? [at[0] - x0 + dx, at[1] - y0 + dy] : [-1, -1];
    const isSeen = x > left + RIM_PX && x < this.size[0] - right - RIM_PX && y > top + RIM_PX && y < this.size[1] - bottom - RIM_PX;
    if (isSeen || this.isFlying) return;
    const shift = place.clone().sub(this.controls.target);
    this.#glideTo(this.camera.position.clone().add(shift).toArray(), place.toArray());
  }

  #aside() {
    const { left, right, top, bottom } = this.covered;
    this.camera.setViewOffset(...this.size, (right - left) / 2, (bottom - top) / 2, ...this.size);
    this.changed();
  }

  /** Camera and what it looks at, six numbers to the millimetre. */
  get place() {
    return [...this.camera.position.toArray(), ...this.#ahead().toArray()].map((v) => Math.round(v * 1000) / 1000);
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
    this.size = sizeOf(this.canvas.parentElement);
    const ratio = Math.min(window.devicePixelRatio, 2);
    const drawn = this.renderer.getDrawingBufferSize(new Vector2());
    // room for pixels is slow to come by, also where it has the size that it had
    if (drawn.x !== Math.floor(this.size[0] * ratio) || drawn.y !== Math.floor(this.size[1] * ratio)) this.renderer.setDrawingBufferSize(...this.size, ratio);
    this.camera.aspect = this.size[0] / this.size[1];
    this.#aside();
  }

  /** Normalised device coordinates of a pointer event. */
  ndc({ clientX, clientY }) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const { shift } = this.halves.find((half) => clientX - left < half.right) ?? this.halves[1];
    return new Vector2(((clientX - left - shift) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
  }

  /** Where a pointer would be that points at what one looks at: the middle of what no panel covers. */
  get middle() {
    const [clientX, clientY] = this.onPage(this.#ahead());
    return { clientX, clientY };
  }

  /** Where a place is drawn, in pixels of the page, of two halves in that of now; null behind the camera. */
  onPage(place) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const v = place.clone().project(this.camera);
    return v.z > 1 ? null : [left + this.halves[1].shift + ((v.x + 1) / 2) * width, top + ((1 - v.y) / 2) * height];
  }

  render() {
    this.camera.updateMatrixWorld();
    for (const step of this.beforeFrame) step();
    // an empty picture costs as much as a full one, and keeps the first tiles waiting
    if (this.isBlank) return;
    if (!this.frames) this.canvas.classList.remove('blank');
    if (this.beside) this.#renderBeside(this.beside);
    else if (this.split) this.#renderBoth(this.split);
    else this.renderer.render(this.scene, this.camera);
    this.frames += 1;
  }

  /**
   * Where two states are drawn beside each other, in pixels: each picture is moved by `shift`, so that what one looks at is in the middle of what no panel covers
   * of its half. Without a second state the right half is all.
   */
  get halves() {
    const [width] = this.size;
    if (!this.beside) return [{ left: 0, right: 0, shift: 0 }, { left: 0, right: width, shift: 0 }];
    const { left, right } = this.covered;
    const middle = Math.round((width + left - right) / 2);
    const shift = Math.round((width - left - right) / 4);
    return [{ left: 0, right: middle, shift: -shift }, { left: middle, right: width, shift }];
  }

  /** Two states in two halves, by the same camera. That of now comes last, and stays. */
  #renderBeside(show) {
    const [width, height] = this.size;
    this.renderer.setScissorTest(true);
    this.halves.forEach(({ left, right, shift }, k) => {
      show(!k);
      this.renderer.setViewport(shift, 0, width, height);
      this.renderer.setScissor(left, 0, right - left, height);
      this.renderer.render(this.scene, this.camera);
    });
    this.renderer.setViewport(0, 0, width, height);
    this.renderer.setScissorTest(false);
  }

  /** Two states by the same camera: `at` is the share of the width at which the one ends, `show` makes either visible. That of now comes last, and stays. */
  #renderBoth({ at, show }) {
    const [width, height] = this.size;
    const middle = Math.round(at * width);
    this.renderer.setScissorTest(true);
    for (const [isOther, left, wide] of [[true, 0, middle], [false, middle, width - middle]]) {
      show(isOther);
      this.renderer.setScissor(left, 0, wide, height);
      this.renderer.render(this.scene, this.camera);
    }
    this.renderer.setScissorTest(false);
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
      this.#glideOn();
      if (this.isFlying && this.pressed.size) this.#flyOn(now);
      else this.flownAt = null;
      this.render();
    });
  }

  #moved() {
    const away = this.camera.position.distanceTo(this.box.getCenter(new Vector3()));
    const reach = this.box.getSize(new Vector3()).length();
    const near = this.isFlying ? 1 : this.camera.position.distanceTo(this.controls.target);
    // nothing stands higher than the box; depth has steps, which are large where what is near is drawn, too
    const clear = Math.max(20, (this.camera.position.z - this.box.max.z) / 4);
    this.camera.near = Math.min(Math.max(near / 50, 0.2), clear);
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
    for (const kind of ['pointerdown', 'wheel', 'keydown']) this.canvas.addEventListener(kind, () => this.glides.delete('look'));
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
