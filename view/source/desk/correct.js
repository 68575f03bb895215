// In the panel of a building: what can be said and corrected of it, notes, and its edits.
import { words } from '../attributes.js';
import { pickCut } from '../cuts.js';
import { toPage, toWorld } from '../data.js';
import { byId, element, say } from '../elements.js';
import { attempt } from './desk.js';

const NEAR_M = 1;

export class Corrections {
  constructor(page) {
    this.page = page;
    this.open_ = null;
    page.desk.onstate.push(() => this.#again());
  }

  /** Put the desk's part before what the panel tells. */
  open(id, unit, known, body) {
    this.open_ = { id, unit, known };
    this.part = element('div', { id: 'desk-building' });
    body.prepend(this.part);
    this.#again();
  }

  #again() {
    if (!this.open_ || !this.part?.isConnected || this.part.contains(document.activeElement) && document.activeElement.value) return;
    const { id, unit, known } = this.open_;
    const isRefused = unit.status === 'refused';
    const { review } = this.page.desk;
    const row = review.row(id);
    const seen = row && review.seen(row);
    this.part.replaceChildren(...[
      element('div', { class: 'row' },
        button(seen ? 'Seen ✓' : 'Seen, fine', 'Mark it as seen, and go on (key: s)', () => review.markSeen(id), { 'aria-pressed': String(Boolean(seen)), id: 'desk-seen' }),
        isRefused ? null : button('Rerun', 'Make this building again (key: r)', () => this.#rerun({}), { id: 'desk-rerun-this' }),
        this.page.photograph ? button('In its photograph', 'The model before the photograph that shows it best (key: i)', () => this.page.photograph.toggle(), { id: 'desk-photograph' }) : null,
        this.page.before.button.disabled ? null : button('Before', 'Models of before the rerun (key: b)', () => this.page.before.toggle())),
      this.page.desk.state.refused ? element('p', { class: 'muted' }, this.page.desk.state.refused) : this.#corrections(id, unit, known, isRefused),
      this.#notes(id),
    ].filter(Boolean));
  }

  #corrections(id, unit, known, isRefused) {
    const { state } = this.page.desk;
    const roofs = element('select', { 'aria-label': 'Roof type', id: 'desk-roof', onchange: (event) => event.target.value && this.#roof(unit, event.target.value) },
      element('option', { value: '' }, 'Roof type …'), state.roofs.map((value) => element('option', { value }, value)));
    const tried = [...new Set((known.scores ?? []).map(({ method }) => method))].filter((method) => state.methods.includes(method));
    const methods = element('select', { 'aria-label': 'Method', id: 'desk-method', onchange: (event) => this.#method(event.target.value) },
      element('option', { value: '' }, 'Other candidate …'), tried.map((value) => element('option', { value }, words(value))), element('option', { value: '*' }, 'the best of all again'));
    const edits = this.#edits();
    return element('details', { open: true, id: 'desk-correct' }, element('summary', {}, 'Correct'),
      element('div', { class: 'row' },
        isRefused ? null : button('Not a building', 'No building stands here', () => this.#reject(id), { id: 'desk-reject' }),
        isRefused ? null : roofs, isRefused || !tried.length ? null : methods),
      element('div', { class: 'row' },
        button('Add border', 'Cut it in two: two clicks', () => this.page.drawing.border((places) => this.#post({ layer: 'cut_lines', rings: [places] }))),
        button('Remove border', 'Click a cut line that is wrong', () => this.#unborder()),
        isRefused ? null : button('Move outline', 'Drag its corners and edges, seen from above', () => this.#move(id, unit, known), { id: 'desk-move' }),
        button('Draw outline', 'A building that is missing', () => this.page.drawing.outline((ring) => this.#post({ layer: 'outlines', rings: [ring] })))),
      edits.length ? element('ol', { class: 'edits' }, edits.map((edit) => this.page.desk.reruns.item(edit))) : null);
  }

  /** Edits that touch the building, the newest first. */
  #edits() {
    const { unit } = this.open_;
    const [x, y] = toWorld(this.page.about, unit.place);
    const reach = unit.size / 2 + NEAR_M;
    const near = ({ rings }) => rings.flat().some(([px, py]) => Math.hypot(px - x, py - y) < reach);
    return this.page.desk.state.edits.filter(near).reverse();
  }

  #notes(id) {
    const notes = this.page.desk.state.notes[id]?.notes ?? [];
    const field = element('input', { type: 'text', placeholder: 'Note', 'aria-label': 'Note', id: 'desk-note', maxlength: 2000 });
    const add = async (event) => {
      event.preventDefault();
      const text = field.value;
      field.value = '';
      field.blur();
      if (text.trim() && (await attempt(() => this.page.desk.post('note', { unit: id, kind: 'note', text })))) await this.page.desk.refresh();
    };
    return element('div', {},
      notes.map(({ text, who, when }) => element('p', { class: 'note' }, text, element('span', { class: 'muted' }, ` – ${who}, ${new Date(1000 * when).toLocaleString()}`))),
      element('form', { class: 'row', onsubmit: add }, field, element('button', { type: 'submit' }, 'Add')));
  }

  async #post(body) {
    const done = await attempt(() => this.page.desk.post('edit', body));
    if (!done) return null;
    await this.page.desk.refresh();
    say('The edit is written; r makes the model that follows from it.');
    return done;
  }

  #rerun(more) {
    const { pending } = this.page.desk.state;
    return this.page.desk.reruns.ask(pending && !Object.keys(more).length ? [] : [this.open_.id], more);
  }

  async #reject(id) {
    const outline = await attempt(() => this.page.desk.get('outline', { unit: id }));
    return outline && this.#post({ layer: 'rejected', rings: outline.rings });
  }

  async #roof(unit, value) {
    const outline = await attempt(() => this.page.desk.get('outline', { unit: this.open_.id }));
    return outline && this.#post({ layer: 'roof_types', rings: outline.rings, value });
  }

  #method(value) {
    return value && this.#rerun(value === '*' ? { clear: true } : { method: value });
  }

  async #move(id, unit, known) {
    const outline = await attempt(() => this.page.desk.get('outline', { unit: id }));
    if (!outline) return;
    const [ring, ...holes] = outline.rings;
    const [x, y, z] = unit.place;
    // where the roof meets the walls: at another height the outline would lie beside the edges that one sees
    const eaves = known.attributes?.eave_height_m;
    const top = typeof eaves === 'number' ? toPage(this.page.about, [...ring[0], eaves])[2] : z;
    this.page.stage.look([x, y - 0.01, top + Math.max(30, 1.6 * unit.size)], [x, y, top]);
    const drawn = this.page.desk.state.edits.find((edit) => (edit.layer === 'locked' || edit.layer === 'outlines') && edit.value === id && edit.edit);
    this.page.drawing.move(ring, top, (moved) => this.#post({ layer: 'locked', rings: [moved, ...holes], value: id, replaces: drawn?.edit ?? '' }));
  }

  /** The next click on a cut line forbids it. */
  async #unborder() {
    const { layers, stage } = this.page;
    if (!this.page.about.layers.cuts) return say('No outline of this run was cut.');
    this.page.drawing.stop();
    const box = byId('layer-cuts');
    if (!box.checked) box.click();
    say('Click the border that is wrong. Esc ends.');
    this.page.taking = (event) => {
      const cut = pickCut({ layers, stage }, event);
      if (!cut) return say('There is no cut line at this place.');
      this.page.taking = null;
      return this.#post({ layer: 'no_cut_lines', rings: [[cut.from, cut.to].map((p) => toWorld(this.page.about, p).slice(0, 2))] });
    };
    return undefined;
  }
}

const button = (text, title, onclick, more = {}) => element('button', { type: 'button', title, onclick, ...more }, text);
