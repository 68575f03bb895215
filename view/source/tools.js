// An inspector's tools: distance and height, area, a section through points and model, residuals of a roof.
import {
  BufferAttribute, BufferGeometry, Group, Line, LineBasicMaterial, Points, PointsMaterial, Vector3,
} from 'three';
import { partOf } from './city.js';
import { diverging, DIVERGING_GRADIENT, POINT_CLASSES, UNKNOWN } from './colours.js';
import { toWorld } from './data.js';
import { byId, element, metres, percent, say } from './elements.js';
import { tilePoints, toLinear } from './layers.js';
import { key } from './legend.js';
import { residuals, roofTriangles, summary } from './residuals.js';
import { profileOf, sectionTriangles } from './section.js';
import { drawProfile, LINES } from './profile.js';

const TOOLS = {
  distance: { points: 2, hint: 'Click two places, or bring them to the middle and press Enter. Esc ends.' },
  area: { points: Infinity, hint: 'Click the corners one after the other, or press Enter in the middle; a double click or Shift and Enter closes the area. Esc ends.' },
  section: { points: 2, hint: 'Click where the section begins and where it ends, or bring both to the middle and press Enter. Esc ends.' },
  residuals: { points: 1, hint: 'Click a building, or press Enter for the one in the middle. Esc ends.' },
};
const INK = '#d6007a';

export class Tools {
  constructor(city, layers, stage, about) {
    Object.assign(this, { city, layers, stage, about });
    this.active = null;
    this.isTelling = false;
    this.places = [];
    this.group = new Group();
    this.width = 1;
    this.tag = null;
    stage.scene.add(this.group);
    stage.beforeFrame.push(() => this.#placeTag());
    byId('tool-close').addEventListener('click', () => this.stop());
    byId('section-width').addEventListener('input', (event) => {
      this.width = Number(event.target.value);
      byId('section-width-value').textContent = metres(this.width, 1);
      if (this.active === 'section' && this.places.length === 2) this.#section();
    });
    new ResizeObserver(() => this.profile && drawProfile(byId('profile'), this.profile)).observe(byId('profile'));
  }

  start(name) {
    const isSame = this.active === name;
    this.stop();
    if (isSame) return;
    this.active = name;
    this.#widen();
    byId(`tool-${name}`).setAttribute('aria-pressed', 'true');
    byId('section-settings').hidden = name !== 'section';
    this.#result(element('p', { class: 'muted' }, TOOLS[name].hint));
    this.stage.canvas.classList.add('aiming');
    say(TOOLS[name].hint);
  }

  /** Something that was clicked says what it is, without a tool in hand. */
  tell(title, rows) {
    this.stop();
    this.isTelling = true;
    this.#figures(rows, element('h2', {}, title));
    return undefined;
  }

  /** A narrow screen has no room for a building's panel beside a tool. */
  #widen() {
    if (window.matchMedia('(max-width: 760px)').matches) byId('panel').hidden = true;
  }

  stop() {
    if (this.active) byId(`tool-${this.active}`).setAttribute('aria-pressed', 'false');
    this.active = null;
    this.isTelling = false;
    this.places = [];
    this.profile = null;
    byId('section-settings').hidden = true;
    this.#clear();
    byId('tool-panel').hidden = true;
    byId('profile').hidden = true;
    this.stage.canvas.classList.remove('aiming');
    this.stage.changed();
  }

  /** A click with a tool in hand. */
  async click(hit) {
    if (!hit) return say('There is nothing at this place.');
    if (this.places.length >= TOOLS[this.active].points) this.places = [];
    this.places.push(hit.place.clone());
    this.#drawWay();
    say(this.places.length === 1 ? 'One place is taken.' : `${this.places.length} places are taken.`);
    if (this.active === 'distance' && this.places.length === 2) this.#distance();
    if (this.active === 'area' && this.places.length > 2) this.#area();
    if (this.active === 'section' && this.places.length === 2) await this.#section();
    if (this.active === 'residuals') await this.#residuals(hit);
    return undefined;
  }

  /** A double click, or Shift and Enter: the area is closed, and the next click begins another. */
  finish() {
    if (this.active !== 'area' || this.places.length < 3) return;
    this.#area();
    this.places = [];
  }

  #result(...content) {
    byId('tool-panel').hidden = false;
    byId('tool-result').replaceChildren(...content);
  }

  #figures(rows, ...before) {
    this.#result(...before, element('dl', { class: 'figures' }, rows.flatMap(([key, value]) => [element('dt', {}, key), element('dd', {}, value)])));
    say(rows.map(([key, value]) => `${key} ${value}`).join(', '));
  }

  /** A figure that stands in the city beside what it measures. */
  #label(text, place) {
    this.tag = { place };
    byId('tag').textContent = text;
    this.stage.changed();
  }

  #placeTag() {
    const at = this.tag && this.stage.onPage(this.tag.place);
    byId('tag').hidden = !at;
    if (!at) return;
    const { left, top } = this.stage.canvas.getBoundingClientRect();
    byId('tag').style.transform = `translate(${at[0] - left + 10}px, ${at[1] - top - 12}px)`;
  }

  #distance() {
    const [a, b] = this.places;
    const way = b.clone().sub(a);
    this.#label(metres(way.length()), a.clone().lerp(b, 0.5));
    const lower = a.z < b.z ? a : b;
    const ground = this.city.below(lower.x, lower.y, 'terrain');
    const world = this.places.map((p) => toWorld(this.about, p.toArray()).map((v) => v.toFixed(2)).join(', '));
    this.#figures([
      ['Distance', metres(way.length())], ['In plan', metres(Math.hypot(way.x, way.y))], ['Height', metres(Math.abs(way.z))],
      ...(ground ? [['Second above the ground', metres(b.z - (this.city.below(b.x, b.y, 'terrain')?.place.z ?? ground.place.z))]] : []),
      ['From', world[0]], ['To', world[1]],
    ]);
  }

  #area() {
    const sum = new Vector3();
    const [first] = this.places;
    for (let i = 1; i + 1 < this.places.length; i += 1) {
      sum.add(this.places[i].clone().sub(first).cross(this.places[i + 1].clone().sub(first)));
    }
    const round = this.places.reduce((length, p, i) => length + p.distanceTo(this.places[(i + 1) % this.places.length]), 0);
    this.#drawWay(true);
    this.#label(`${(sum.length() / 2).toFixed(1)} m²`, this.places.reduce((at, p) => at.add(p), new Vector3()).divideScalar(this.places.length));
    this.#figures([['Area', `${(sum.length() / 2).toFixed(2)} m²`], ['In plan', `${(Math.abs(sum.z) / 2).toFixed(2)} m²`], ['Way around', metres(round)]]);
  }

  async #section() {
    const [a, b] = this.places;
    this.#result(element('p', { class: 'muted' }, 'Reading points …'));
    const lines = [...this.city.meshes()].flatMap(({ mesh }) => sectionTriangles(mesh, partOf(mesh), a, b));
    const clouds = await this.#points(Math.min(a.x, b.x), Math.min(a.y, b.y), Math.max(a.x, b.x), Math.max(a.y, b.y), this.width);
    const profile = profileOf(a, b, this.width, clouds);
    this.profile = { ...profile, lines, length: Math.hypot(b.x - a.x, b.y - a.y), lift: this.#lift(a) };
    byId('profile').hidden = false;
    const drawn = drawProfile(byId('profile'), this.profile);
    this.#figures([
      ['Length', metres(this.profile.length)], ['Points', `${profile.count.toLocaleString('en')} within ${metres(this.width / 2, 2)} of the line`],
      ['Heights', drawn.exaggeration > 0.99 ? 'to the same scale' : `shrunk to ${percent(drawn.exaggeration)}`],
    ]);
    byId('tool-result').append(key(LINES.buildings[0], 'model'), key(LINES.terrain[0], 'terrain'), ...pointKeys(profile.points));
    if (!this.about.tiles.some((t) => t.points)) say('The run has no points for this page: the section shows the model only.');
  }

  /** What to add to heights of the page's frame to have those of the survey. */
  #lift(place) {
    return toWorld(this.about, place.toArray())[2] - place.z;
  }

  async #residuals(hit) {
    if (!hit.unit) return this.#result(element('p', {}, 'This is no building.'));
    if (hit.isFar) return this.#result(element('p', {}, 'This is a block that stands for a building far away: come nearer.'));
    const triangles = roofTriangles(this.city, hit.unit);
    const { box } = triangles;
    const clouds = await this.#points(...box, 0.5);
    const found = residuals(triangles, clouds);
    const figures = summary(found.values);
    this.#clear();
    if (!figures) return this.#result(element('p', {}, 'The run has no points for this page over this roof.'));
    this.group.add(residualCloud(found));
    this.stage.changed();
    const nearest = nearestValue(found, hit.place);
    const known = (await this.city.units.find(hit.unit))?.nmad;
    this.#figures([
      ['Building', hit.unit], ['Points over the roof', figures.count.toLocaleString('en')],
      ['At the click', nearest === null ? 'no point within 1 m' : `${(100 * nearest).toFixed(1)} cm`],
      ['Median', `${(100 * figures.median).toFixed(1)} cm`], ['NMAD', `${(100 * figures.nmad).toFixed(1)} cm`], ['RMSE', `${(100 * figures.rmse).toFixed(1)} cm`],
      ['Within 20 cm', percent(figures.within)], ...(known ? [['NMAD of the run', `${(100 * known).toFixed(1)} cm`]] : []),
    ]);
    byId('tool-result').append(
      element('div', { class: 'scale', style: `background:${DIVERGING_GRADIENT}` }),
      element('p', { class: 'ends' }, element('span', {}, '−30 cm below'), element('span', {}, 'above +30 cm')),
      known ? element('p', { class: 'muted' }, 'All points over the roof count here; the run leaves out crowns and what stands beside the outline.') : '',
    );
    return undefined;
  }

  /** Points of all tiles that a box touches. */
  async #points(x0, y0, x1, y1, margin) {
    const touched = this.about.tiles.filter(
      ({ points, box }) => points && box[0] < x1 + margin && box[2] > x0 - margin && box[1] < y1 + margin && box[3] > y0 - margin,
    );
    return Promise.all(touched.map(tilePoints));
  }

  #drawWay(isClosed = false) {
    this.#clear();
    const way = isClosed ? [...this.places, this.places[0]] : this.places;
    const geometry = new BufferGeometry().setFromPoints(way);
    const line = new Line(geometry, new LineBasicMaterial({ color: INK, depthTest: false }));
    const dots = new Points(geometry, new PointsMaterial({ color: INK, size: 9, sizeAttenuation: false, depthTest: false }));
    for (const drawn of [line, dots]) {
      drawn.renderOrder = 10;
      this.group.add(drawn);
    }
    this.stage.changed();
  }

  #clear() {
    this.tag = null;
    for (const child of [...this.group.children]) {
      child.geometry.dispose();
      child.material.dispose();
      this.group.remove(child);
    }
  }
}

/** What the colours of a section's points mean. */
function pointKeys(points) {
  const kinds = new Map(points.filter(([, , , rgb]) => !rgb).map(([, , kind]) => POINT_CLASSES[kind] ?? ['Other points', UNKNOWN]));
  const keys = [...kinds].map(([title, colour]) => key(colour, `points: ${title.toLowerCase()}`));
  return points.some(([, , , rgb]) => rgb) ? [...keys, element('p', { class: 'muted' }, 'Points in the colours of the photographs.')] : keys;
}

function residualCloud({ places, values }) {
  const geometry = new BufferGeometry();
  const colours = new Uint8Array(3 * values.length);
  values.forEach((value, i) => colours.set(diverging(value / 0.3), 3 * i));
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
  geometry.setAttribute('color', new BufferAttribute(colours, 3, true));
  const material = new PointsMaterial({ size: 5, sizeAttenuation: false, vertexColors: true });
  toLinear(material);
  return new Points(geometry, material);
}

function nearestValue({ places, values }, at) {
  let best = 1;
  let found = null;
  values.forEach((value, i) => {
    const away = Math.hypot(places[3 * i] - at.x, places[3 * i + 1] - at.y);
    if (away < best) [best, found] = [away, value];
  });
  return found;
}

