// The review list: buildings by what a look at them is worth, with filters; next and previous by key.
import { STATUS, VERDICT } from '../colours.js';
import { words } from '../attributes.js';
import { element, percent, say } from '../elements.js';
import { isTyping } from './before.js';
import { attempt } from './desk.js';

const SHOWN_AT_ONCE = 200;
/** Probability that a border is wrong or lacking, from which it is worth a look (`viewer/review_list.py`). */
const DOUBTFUL_BORDER = 0.25;
/** How little of a model is a building by its points, from which it may be none (same place). */
const SUSPECTED = 0.5;
const STATES = [
  ['', 'all'], ['open', 'worth a look, not seen'], ['failed', 'failed'], ['degraded', 'simplified'], ['poor', 'poor'], ['look', 'to look at'], ['good', 'good'],
  ['none', 'perhaps no building'], ['border', 'doubtful border'], ['refused', 'refused'], ['noted', 'with a note'], ['seen', 'seen, fine'],
];

export class Review {
  constructor(page, root) {
    Object.assign(this, { page, rows: [], shown: [], most: SHOWN_AT_ONCE });
    const select = (title, options) => element('label', { class: 'wide' }, title, element('select', { 'aria-label': title, onchange: () => this.#filter() }, options));
    this.state = select('Status', STATES.map(([value, title]) => element('option', { value, selected: value === 'open' }, title)));
    this.tile = select('Tile', [element('option', { value: '' }, 'all')]);
    this.method = select('Method', [element('option', { value: '' }, 'all')]);
    this.reason = element('input', { type: 'search', placeholder: 'words of the reason', 'aria-label': 'Reason', id: 'desk-reason', oninput: () => this.#filter() });
    this.count = element('p', { class: 'muted', id: 'desk-count' });
    this.list = element('ol', { id: 'desk-list', 'aria-label': 'Buildings by what a look at them is worth' });
    this.more = element('button', { type: 'button', hidden: true, onclick: () => this.#longer() }, 'More');
    root.append(
      element('div', { class: 'filters' }, this.state, this.tile, this.method, this.reason), this.count,
      element('div', { class: 'row' }, element('button', { type: 'button', title: 'The one before (key: p)', onclick: () => this.step(-1) }, 'Previous'), element('button', { type: 'button', id: 'desk-next', title: 'The next one (key: n)', onclick: () => this.step(1) }, 'Next'), page.before.button, page.before.both),
      this.list, this.more,
    );
    page.desk.onstate.push(() => this.#filter());
    window.addEventListener('keydown', (event) => this.#keyed(event));
  }

  /** Rows of all buildings, from the server. */
  async read() {
    this.rows = await this.page.desk.get('review');
    fill(this.tile, this.rows.map(({ tile }) => tile));
    fill(this.method, this.rows.map(({ method }) => method), words);
    this.#filter();
  }

  /** The mark of a building, null where its model has changed since. */
  seen(row) {
    const seen = this.page.desk.state.notes[row.id]?.seen;
    return seen && seen.model === row.model ? seen : null;
  }

  row(id) {
    return this.rows.find((row) => row.id === id) ?? null;
  }

  /** Choose the building so many places further in the list, and go there. */
  step(by) {
    const at = this.shown.findIndex(({ id }) => id === this.page.city.selected);
    const next = at < 0 ? this.#after(by) : at + by;
    if (next < 0 || next >= this.shown.length) return say(this.shown.length ? 'This is the end of the list.' : 'No building is in the list.');
    return this.choose(this.shown[next]);
  }

  /** Where one goes on from a building that has left the list: what stood behind it has its place now. */
  #after(by) {
    const last = this.last ?? -1;
    return by > 0 ? Math.max(last, 0) : last - 1;
  }

  async choose(row) {
    this.last = this.shown.indexOf(row);
    if (this.last >= this.most) this.#longer(this.last);
    await this.page.go(row.id);
    this.#mark();
    return row;
  }

  /** Mark the chosen building as seen, or take that back; after a mark the next one comes. */
  async markSeen(id = this.page.city.selected) {
    const row = this.row(id);
    if (!row) return say('Choose a building first.');
    const was = this.seen(row);
    const done = await attempt(() => this.page.desk.post('note', { unit: id, kind: was ? 'unseen' : 'seen' }));
    if (!done) return undefined;
    await this.page.desk.refresh();
    return was ? say('The mark is taken back.') : this.step(1);
  }

  #keyed(event) {
    if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey || this.page.stage.isFlying) return;
    if (event.key === 'n') this.step(1);
    else if (event.key === 'p') this.step(-1);
    else if (event.key === 's') this.markSeen();
  }

  #filter() {
    const [state, tile, method] = [this.state, this.tile, this.method].map((label) => label.querySelector('select').value);
    const words = this.reason.value.toLowerCase();
    this.shown = this.rows.filter((row) => (!tile || row.tile === tile) && (!method || row.method === method) && row.reason.toLowerCase().includes(words) && this.#is(row, state));
    this.most = SHOWN_AT_ONCE;
    this.#draw();
    this.page.desk.reruns?.allow();
  }

  #is(row, state) {
    if (state === 'open') return row.status !== 'refused' && (row.status === 'failed' || row.status === 'degraded' || row.verdict !== 'good' || row.suspicion >= SUSPECTED || row.border >= DOUBTFUL_BORDER) && !this.seen(row);
    if (state === 'none') return row.suspicion >= SUSPECTED;
    if (state === 'border') return row.border >= DOUBTFUL_BORDER;
    if (state === 'seen') return Boolean(this.seen(row));
    if (state === 'noted') return Boolean(this.page.desk.state.notes[row.id]?.notes.length);
    return !state || row.status === state || row.verdict === state;
  }

  #longer(to = 0) {
    this.most = Math.max(this.most, to) + SHOWN_AT_ONCE;
    this.#draw();
  }

  #draw() {
    this.count.textContent = `${this.shown.length.toLocaleString('en')} of ${this.rows.length.toLocaleString('en')} buildings`;
    this.list.replaceChildren(...this.shown.slice(0, this.most).map((row) => this.#item(row)));
    this.more.hidden = this.shown.length <= this.most;
    this.#mark();
  }

  #item(row) {
    const [word, colour] = row.status === 'done' && row.verdict ? VERDICT[row.verdict] : STATUS[row.status];
    const share = row.probability === null || row.status === 'failed' ? '' : ` · ${percent(row.probability)} good`;
    const seen = this.seen(row);
    return element(
      'li', {},
      element('button', { type: 'button', 'data-unit': row.id, title: row.reason, onclick: () => this.choose(row) },
        element('span', {}, element('i', { style: `background:${colour}`, 'aria-hidden': 'true' }), element('b', {}, row.id)),
        element('span', { class: 'muted' }, `${word}${share}${seen ? ` · seen by ${seen.who}` : ''}`),
        element('span', { class: 'why' }, row.reason)),
    );
  }

  #mark() {
    for (const button of this.list.querySelectorAll('button')) {
      const isChosen = button.dataset.unit === this.page.city.selected;
      button.setAttribute('aria-current', String(isChosen));
      if (isChosen) button.scrollIntoView({ block: 'nearest' });
    }
  }
}

function fill(label, values, told = String) {
  const select = label.querySelector('select');
  const chosen = select.value;
  const found = [...new Set(values)].filter(Boolean).sort();
  select.replaceChildren(element('option', { value: '' }, 'all'), ...found.map((value) => element('option', { value, selected: value === chosen }, told(value))));
}
