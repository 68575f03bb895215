// Drawing on the map: a border by its two ends, an outline by its corners, and the corners and edges of an outline that is there.
import { Group, Plane, Points, PointsMaterial, BufferGeometry, Raycaster, Vector3 } from 'three';
import { distanceToSegment } from '../cuts.js';
import { toPage, toWorld } from '../data.js';
import { byId, element, say } from '../elements.js';
import { disposed, linesOf } from '../highlight.js';

const INK = '#ff2fa0';
const REACH_PX = 12;
const ABOVE = new Vector3(0, 0, 1);

/** One thing is drawn at a time. Places are [x, y, z] in the page's frame; what was not moved keeps its world coordinates. */
export class Drawing {
  constructor(page) {
    Object.assign(this, { page, mode: null, places: [], group: new Group(), held: null, raycaster: new Raycaster() });
    page.stage.scene.add(this.group);
    this.bar = element('div', { id: 'desk-drawing', class: 'hint', hidden: true });
    byId('stage').append(this.bar);
    const { canvas } = page.stage;
    canvas.addEventListener('pointerdown', (event) => this.#grab(event), true);
    window.addEventListener('pointermove', (event) => this.#drag(event), true);
    window.addEventListener('pointerup', () => this.#drop(), true);
    canvas.addEventListener('dblclick', (event) => this.#split(event), true);
    window.addEventListener('keydown', (event) => event.key === 'Escape' && this.mode && (event.stopImmediatePropagation(), this.stop()), true);
  }

  get isActive() {
    return this.mode !== null;
  }

  /** A straight border: two clicks, and it is done. */
  border(done) {
    this.#begin('border', 'Click both ends of the border. Esc ends.', done);
  }

  /** A new outline: its corners one after the other. */
  outline(done) {
    this.#begin('outline', 'Click the corners of the outline. Esc ends.', done, true);
  }

  /** An outline that is there, world metres, at a height of the page: drag a corner or an edge, double click an edge for a corner. */
  move(ring, height, done) {
    this.#begin('move', 'Drag a corner or an edge; a double click on an edge adds a corner, on a corner removes it. Esc ends.', done, true);
    const ends = ring.slice(0, -1);
    this.places = ends.map(([x, y]) => ({ world: [x, y], at: this.#over([x, y], height) }));
    this.height = this.places[0].at[2];
    this.#draw();
  }

  #over([x, y], height) {
    const [e, n] = toPage(this.page.about, [x, y, height]);
    return [e, n, height];
  }

  #begin(mode, hint, done, hasButton = false) {
    this.stop();
    this.page.taking = null; // a border that was to be removed: clicks are of what is drawn now
    Object.assign(this, { mode, done, places: [], height: null });
    const save = hasButton ? element('button', { type: 'button', id: 'desk-save', onclick: () => this.#save() }, 'Save') : null;
    this.bar.replaceChildren(element('span', {}, hint, ' '), ...[save, element('button', { type: 'button', onclick: () => this.stop() }, 'Cancel')].filter(Boolean));
    this.bar.hidden = false;
    this.page.stage.canvas.classList.add('aiming');
    say(hint);
  }

  stop() {
    this.mode = null;
    this.#drop();
    this.places = [];
    this.#draw();
    this.bar.hidden = true;
    this.page.stage.canvas.classList.remove('aiming');
  }

  /** A click on the city, and what it hit. */
  click(hit) {
    if (this.mode === 'move') return;
    if (!hit) {
      say('There is nothing at this place.');
      return;
    }
    this.places.push({ world: toWorld(this.page.about, hit.place.toArray()).slice(0, 2), at: hit.place.toArray() });
    this.#draw();
    if (this.mode === 'border' && this.places.length === 2) this.#save();
  }

  async #save() {
    const { done, mode } = this;
    const places = this.places.map(({ world }) => world);
    if (mode !== 'border' && places.length < 3) return say('An outline has three corners at least.');
    this.stop();
    return done(mode === 'border' ? places : [...places, places[0]]);
  }

  #draw() {
    disposed(this.group);
    this.group.clear();
    if (this.places.length) {
      const at = this.places.map((place) => place.at);
      const isClosed = this.mode !== 'border' && at.length > 2;
      const pairs = at.slice(isClosed ? 0 : 1).flatMap((p, i) => [...at[isClosed ? (i + at.length - 1) % at.length : i], ...p]);
      if (pairs.length) {
        const lines = linesOf(pairs, INK, 3);
        lines.renderOrder = 8;
        this.group.add(lines);
      }
      const corners = new Points(new BufferGeometry().setFromPoints(at.map((p) => new Vector3(...p))), new PointsMaterial({ color: INK, size: 10, sizeAttenuation: false, depthTest: false }));
      corners.renderOrder = 8;
      this.group.add(corners);
    }
    this.page.stage.changed();
  }

  /** A corner, else an edge by its first corner, within some pixels of the pointer. */
  #under({ clientX, clientY }) {
    const on = this.places.map(({ at }) => this.page.stage.onPage(new Vector3(...at)));
    const away = on.map((p) => (p ? Math.hypot(p[0] - clientX, p[1] - clientY) : Infinity));
    const corner = away.indexOf(Math.min(...away));
    if (away[corner] < REACH_PX) return { corners: [corner] };
    for (let i = 0; i < on.length; i += 1) {
      const [a, b] = [on[i], on[(i + 1) % on.length]];
      if (a && b && distanceToSegment([clientX, clientY], a, b) < REACH_PX) return { corners: [i, (i + 1) % on.length], isEdge: true };
    }
    return null;
  }

  #grab(event) {
    if (this.mode !== 'move' || event.button !== 0) return;
    const found = this.#under(event);
    if (!found) return;
    event.stopImmediatePropagation();
    const from = this.#onPlane(event);
    if (!from) return;
    this.page.stage.controls.enabled = false;
    this.held = { ...found, from, before: found.corners.map((i) => [...this.places[i].at]) };
  }

  #drag(event) {
    if (!this.held) return;
    const to = this.#onPlane(event);
    if (!to) return;
    let shift = to.sub(this.held.from);
    if (this.held.isEdge) shift = shift.projectOnVector(this.#across());
    this.held.corners.forEach((i, k) => {
      const at = new Vector3(...this.held.before[k]).add(shift).toArray();
      this.places[i] = { at, world: toWorld(this.page.about, at).slice(0, 2) };
    });
    this.#draw();
  }

  /** The direction that an edge moves in: square to it. */
  #across() {
    const [[x0, y0], [x1, y1]] = this.held.before;
    return new Vector3(y0 - y1, x1 - x0, 0);
  }

  #drop() {
    if (!this.held) return;
    this.held = null;
    this.page.stage.controls.enabled = !this.page.stage.isFlying;
  }

  #split(event) {
    if (this.mode !== 'move') return;
    event.stopImmediatePropagation();
    const found = this.#under(event);
    if (!found) return;
    if (!found.isEdge) {
      if (this.places.length > 3) this.places.splice(found.corners[0], 1);
    } else {
      const at = this.#onPlane(event).toArray();
      this.places.splice(found.corners[0] + 1, 0, { at, world: toWorld(this.page.about, at).slice(0, 2) });
    }
    this.#draw();
  }

  #onPlane(event) {
    this.raycaster.setFromCamera(this.page.stage.ndc(event), this.page.stage.camera);
    return this.raycaster.ray.intersectPlane(new Plane(ABOVE, -this.height), new Vector3());
  }
}
