// What a driver does: tiles by state, stages with their pace, time left, failures as they come.
import { element } from '../elements.js';

const STATES = { waiting: '#8b98a5', 'at work': '#e0a030', done: '#2f9e8f', failed: '#d62f2f' };
const MAP_PX = 288;

export class Watch {
  constructor(desk, root) {
    Object.assign(this, { desk, driver: null, tiles: {}, paces: new Map() });
    this.text = element('p', { id: 'desk-driver' }, 'Loading …');
    this.link = element('a', { class: 'button', target: '_blank', rel: 'noopener', hidden: true }, 'Dask dashboard');
    this.map = element('canvas', { id: 'desk-map', role: 'img', 'aria-label': 'Ground tiles by state' });
    this.key = element('p', { class: 'muted' });
    this.stages = element('table', { id: 'desk-stages' });
    this.failures = element('ol', { id: 'desk-failures', 'aria-label': 'Failures, the newest first' });
    root.append(this.text, this.link, this.map, this.key, element('div', { class: 'scroll' }, this.stages), element('h3', {}, 'Failures'), this.failures);
  }

  async read() {
    this.told(await this.desk.get('standing'));
  }

  /** News: what the driver says, or the state of each tile. */
  told(news) {
    if ('driver' in news) this.#driver(news.driver);
    if (news.tiles) this.#tiles(news.tiles);
  }

  #driver(driver) {
    this.driver = driver;
    this.text.textContent = driver ? [driver.is_at_work ? driver.overall || driver.text : `The last driver ${driver.text}.`].join(' ') : 'No driver has worked here yet.';
    this.link.hidden = !driver?.page;
    if (driver?.page && /^https?:/.test(driver.page)) this.link.href = driver.page;
    const rows = Object.entries(driver?.stages ?? {}).map(([stage, n]) => [stage, `${n.finished}/${n.total}`, n.failed || '', this.#pace(stage, n)]);
    const head = element('tr', {}, ['Stage', 'Finished', 'Failed', 'Per minute'].map((title) => element('th', { scope: 'col' }, title)));
    this.stages.replaceChildren(element('thead', {}, head), element('tbody', {}, rows.map(([stage, ...cells]) => element('tr', {}, element('th', { scope: 'row' }, stage), cells.map((cell) => element('td', {}, String(cell)))))));
    const failures = driver?.failures ?? [];
    this.failures.replaceChildren(...(failures.length ? failures.map(([stage, unit, reason]) => element('li', {}, element('b', {}, `${stage} ${unit}`), element('span', { class: 'why' }, reason))) : [element('li', { class: 'muted' }, 'None.')]));
  }

  /** Tasks of a stage per minute, over what was seen in the last minute. */
  #pace(stage, { finished }) {
    const now = performance.now();
    const seen = [...(this.paces.get(stage) ?? []), [now, finished]].filter(([when]) => now - when < 60e3);
    this.paces.set(stage, seen);
    const [[begun, first]] = seen;
    return this.driver?.is_at_work && now - begun > 3e3 && finished > first ? ((60e3 * (finished - first)) / (now - begun)).toFixed(0) : '';
  }

  #tiles(tiles) {
    this.tiles = tiles;
    const places = Object.entries(tiles).map(([name, state]) => [...name.split('_').map(Number), state]).filter(([col, row]) => Number.isFinite(col) && Number.isFinite(row));
    const counts = Object.keys(STATES).map((state) => [state, places.filter((place) => place[2] === state).length]);
    this.key.replaceChildren(...counts.map(([state, n]) => element('span', { class: 'key' }, element('i', { style: `background:${STATES[state]}` }), `${n} ${state}  `)));
    this.map.hidden = !places.length;
    if (!places.length) return;
    const [cols, rows] = [0, 1].map((k) => places.map((place) => place[k]));
    const [left, low] = [least(cols), least(rows)];
    const size = Math.max(Math.floor(MAP_PX / Math.max(most(cols) - left + 1, most(rows) - low + 1)), 1);
    this.map.width = (most(cols) - left + 1) * size;
    this.map.height = (most(rows) - low + 1) * size;
    const pen = this.map.getContext('2d');
    const gap = size > 4 ? 1 : 0;
    for (const [col, row, state] of places) {
      pen.fillStyle = STATES[state];
      pen.fillRect((col - left) * size, this.map.height - (row - low + 1) * size, size - gap, size - gap);
    }
  }
}

const least = (values) => values.reduce((a, b) => Math.min(a, b));
const most = (values) => values.reduce((a, b) => Math.max(a, b));
