// Another state of the city beside that of now: both in one scene, parted by a slider, with a table of their differences.
import { Group, Vector3 } from 'three';
import { words } from '../attributes.js';
import { City } from '../city.js';
import { VERDICT } from '../colours.js';
import { json } from '../data.js';
import { byId, centimetres, element, say } from '../elements.js';
import { forgotten, plainModel } from '../plain.js';
import { Units } from '../units.js';
import { isTyping } from './before.js';
import { attempt } from './desk.js';

const METHOD = 'method ';
const STEP = 0.02;
const MOST_TILES = 64;
const MOST_ROWS = 500;

export class Compare {
  constructor(page, root) {
    Object.assign(this, { page, others: [], key: '', of: null, at: null, other: null, group: null, rows: [], reading: 0 });
    this.choice = element('select', { 'aria-label': 'Compare with', id: 'compare-with', onchange: () => this.open(this.choice.value) });
    this.kind = element('select', { 'aria-label': 'Differences', id: 'compare-kind', hidden: true, onchange: () => this.#list() });
    this.told = element('p', { class: 'muted', id: 'compare-told' });
    this.table = element('table', { id: 'compare-table', 'aria-label': 'Differences' });
    root.append(element('label', { class: 'wide' }, 'Compare with', this.choice), this.kind, this.told, element('div', { class: 'scroll' }, this.table));
    this.names = [element('span', {}), element('span', {}, 'now')];
    this.line = element('div', { id: 'compare-line', role: 'slider', tabindex: 0, hidden: true, 'aria-label': 'Where the other state ends and that of now begins', 'aria-valuemin': 0, 'aria-valuemax': 100 }, this.names);
    byId('stage').append(this.line);
    this.#wire();
    page.stage.beforeFrame.push(() => this.#follow());
    new ResizeObserver(() => this.other?.resize()).observe(page.stage.canvas.parentElement);
  }

  #wire() {
    const { canvas } = this.page.stage;
    this.line.addEventListener('pointerdown', (event) => {
      this.line.setPointerCapture(event.pointerId);
      event.preventDefault();
      this.line.focus();
    });
    this.line.addEventListener('pointermove', (event) => {
      if (!this.line.hasPointerCapture(event.pointerId)) return;
      const { left, width } = canvas.getBoundingClientRect();
      this.part((event.clientX - left) / width);
    });
    this.line.addEventListener('keydown', ({ key }) => {
      const by = { ArrowLeft: -STEP, ArrowDown: -STEP, ArrowRight: STEP, ArrowUp: STEP, Home: -1, End: 1 }[key];
      if (by) this.part(this.at + by);
    });
    window.addEventListener('keydown', (event) => {
      if (event.key === 'c' && !isTyping(event) && !event.ctrlKey && !event.metaKey && !event.altKey && !this.page.stage.isFlying) this.toggle();
    });
  }

  get isLoading() {
    return this.reading > 0 || Boolean(this.other?.isLoading);
  }

  /** What there is to compare with, from the server. */
  async read() {
    this.others = (await attempt(() => this.page.desk.get('others'))) ?? [];
    this.#offerAll();
  }

  /** Candidates of the chosen building may be compared with the model that was kept. */
  offer(id, known) {
    if (this.key.startsWith(METHOD) && this.of?.id !== id) this.leave();
    const methods = (known.scores ?? []).filter(({ faces }, k) => faces && k !== known.kept).map(({ method }) => method);
    this.of = { id, methods };
    this.#offerAll();
  }

  #offerAll() {
    const option = (value, title) => element('option', { value, selected: value === this.key }, title);
    const { id, methods = [] } = this.of ?? {};
    this.choice.replaceChildren(
      option('', this.others.length || methods.length ? 'nothing' : 'nothing: no other run, no update'), ...this.others.map(({ key, title }) => option(key, title)),
      ...(methods.length ? [element('optgroup', { label: `Candidates of ${id}` }, methods.map((method) => option(METHOD + method, words(method))))] : []),
    );
  }

  /** With what was compared last, else with the first there is; or with nothing. */
  toggle() {
    if (this.key) return this.leave();
    const [first] = [...this.choice.options].filter(({ value }) => value);
    if (!first) return say('There is nothing to compare with: start `cityflow desk RUN --with OTHER`, or choose a building with candidates.');
    return this.open(first.value);
  }

  async open(key) {
    this.leave();
    this.page.before.leave();
    this.key = this.choice.value = key;
    if (!key) return;
    this.reading += 1;
    try {
      await attempt(() => this.#begin(key));
    } finally {
      this.reading -= 1;
    }
    this.page.stage.changed();
  }

  async #begin(key) {
    const { page } = this;
    page.city.showFormer(false);
    if (key.startsWith(METHOD)) return this.#method(key.slice(METHOD.length));
    const { title, base } = this.others.find((other) => other.key === key);
    if (base) await this.#run(base);
    else await this.#former(key);
    if (this.key !== key) return undefined;
    this.#part(title);
    this.told.textContent = 'Comparing …';
    const found = await attempt(() => page.desk.get('differences', { of: key }));
    if (this.key === key) this.#tell(found);
    return undefined;
  }

  /** Another run's city in the frame and the colours of this one. */
  async #run(base) {
    const { about, stage, city } = this.page;
    const [theirs, root] = await Promise.all([json(`${base}data/city.json`), json(`${base}data/index.json`)]);
    this.other = new City({ ...theirs, frame: about.frame, scales: about.scales }, new Units(root, base), stage, base);
    this.other.onfailure = city.onfailure;
    this.show = (isOther) => {
      city.tiles.group.visible = !isOther;
      this.other.tiles.group.visible = isOther;
    };
  }

  /** Models of before an update, of the tiles nearest to what one looks at. */
  async #former(key) {
    const { index, stage, city } = this.page;
    this.#group('buildings');
    const { x, y } = stage.controls.target;
    const away = ({ box }) => (box ? Math.hypot((box[0] + box[3]) / 2 - x, (box[1] + box[4]) / 2 - y) : Infinity);
    const near = [...index.tiles].sort((a, b) => away(a) - away(b)).slice(0, MOST_TILES);
    for (const { name } of near) {
      const models = await this.page.desk.get('former', { of: key, tile: name });
      if (this.key !== key) return;
      this.group.add(...models.map(plainModel));
    }
    city.stage.changed();
  }

  async #method(method) {
    const { id } = this.of;
    const { models, what } = await this.page.desk.get('candidate', { unit: id, method });
    if (this.key !== METHOD + method) return;
    this.#group('chosen');
    this.group.add(...models.map(plainModel));
    this.#part(words(method));
    this.told.textContent = `${words(method)} on the left, the model that was kept on the right${what ? `: from the one to the other ${what}` : '; they differ by less than a change counts'}.`;
  }

  #group(without) {
    this.group = new Group();
    this.page.stage.scene.add(this.group);
    this.show = (isOther) => {
      this.group.visible = isOther;
      this.page.city.without(isOther ? without : null);
    };
  }

  #part(title) {
    this.names[0].textContent = title;
    this.line.hidden = false;
    const { size: [width], aim, covered } = this.page.stage;
    const { left, right } = aim ?? covered;
    this.part(this.at ?? (width + left - right) / (2 * width));
    say('On the left the other state, on the right that of now. Drag the line, or move it with the arrow keys; c ends.');
  }

  /** Where the line stands, as a share of the width. */
  part(at) {
    this.at = Math.min(Math.max(at, 0), 1);
    this.line.style.left = `${100 * this.at}%`;
    this.line.setAttribute('aria-valuenow', String(Math.round(100 * this.at)));
    if (this.show) this.page.stage.split = { at: this.at, show: this.show };
    this.page.stage.changed();
  }

  leave() {
    const { stage, city } = this.page;
    stage.split = null;
    if (this.other) this.other.end();
    if (this.group) {
      stage.scene.remove(this.group);
      forgotten(this.group.children);
    }
    if (this.show) {
      city.without(null);
      city.showFormer(false);
      if (city.tiles) city.tiles.group.visible = true;
    }
    Object.assign(this, { key: '', other: null, group: null, show: null, rows: [] });
    this.choice.value = '';
    this.line.hidden = this.kind.hidden = true;
    this.told.textContent = '';
    this.table.replaceChildren();
    stage.changed();
  }

  /** What is chosen for the one state counts for the other, too. */
  #follow() {
    const { other, page: { city } } = this;
    if (!other) return;
    if (other.mode !== city.mode) other.colourBy(city.mode);
    if ((other.set !== city.set || other.isDivided !== city.isDivided) && other.about.sets[city.set]) other.textures(city.set, city.isDivided);
    for (const part of ['terrain', 'buildings']) if (other.shown[part] !== city.shown[part]) other.show(part, city.shown[part]);
    other.update();
  }

  #tell(found) {
    if (!found) {
      this.told.textContent = 'The differences cannot be told.';
      return;
    }
    const { rows, compared, untouched, without_model: bare, unclear } = found;
    this.rows = rows;
    const count = (kind) => rows.filter((row) => row.kind === kind).length;
    const kinds = [...new Set(rows.map(({ kind }) => kind))];
    const more = [[bare, 'without a model in one of both'], [unclear, 'unclear']].filter(([names]) => names.length).map(([names, text]) => `, ${names.length} ${text}`);
    this.told.textContent = `${kinds.length ? kinds.map((kind) => `${count(kind)} ${kind}`).join(', ') : 'No difference'}. Unchanged: ${untouched} with the same outline and model, ${compared} with another one, but by less than a change counts${more.join('')}.`;
    this.kind.hidden = kinds.length < 2;
    this.kind.replaceChildren(element('option', { value: '' }, `all ${rows.length} differences`), ...kinds.map((kind) => element('option', { value: kind }, `${count(kind)} ${kind}`)));
    this.#list();
  }

  #list() {
    const shown = this.rows.filter(({ kind }) => !this.kind.value || kind === this.kind.value).slice(0, MOST_ROWS);
    const head = ['Building', 'What', 'Ridge m', 'Volume m³', 'NMAD'];
    this.table.replaceChildren(
      element('thead', {}, element('tr', {}, head.map((title) => element('th', { scope: 'col' }, title)))),
      element('tbody', {}, shown.map((row) => this.#row(row))),
    );
  }

  #row(row) {
    const name = row.id || row.before;
    const [was, now] = row.verdict ?? [null, null];
    const judged = row.kind !== 'judged otherwise' && was && now && was !== now ? `; ${VERDICT[was][0].toLowerCase()} → ${VERDICT[now][0].toLowerCase()}` : '';
    const nmad = (row.nmad ?? []).map((v) => (v === null ? '–' : centimetres(v)));
    return element('tr', { 'data-unit': name, 'data-kind': row.kind },
      element('th', { scope: 'row' }, element('button', { type: 'button', onclick: () => this.#go(row) }, name)),
      element('td', {}, `${row.kind === 'judged otherwise' ? '' : `${row.kind}: `}${row.what}${judged}`),
      element('td', {}, signed(row.ridge_m, 1)), element('td', {}, signed(row.volume_m3, 0)), element('td', {}, nmad[0] === nmad[1] ? nmad[0] ?? '' : nmad.join(' → ')));
  }

  async #go(row) {
    const { index, panel, stage } = this.page;
    if (row.id && (await index.find(row.id))) return this.page.go(row.id);
    panel.wired.onclose(); // one that is no more has none, and that of another would be taken for its
    return row.place && stage.approach(new Vector3(...row.place), Math.max(30, 2.5 * row.size));
  }
}

const signed = (value, digits) => (value === null || value === undefined ? '' : `${value >= 0 ? '+' : '−'}${Math.abs(value).toFixed(digits)}`);
