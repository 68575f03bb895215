// All that is known of a chosen building.
import { grouped, words } from './attributes.js';
import { CLASSES, STATUS, VERDICT } from './colours.js';
import { json } from './data.js';
import { byId, centimetres, copy, element, percent, say } from './elements.js';

const LEAST_SHARE = 0.001;
const SCORES = [
  ['within_20cm', 'of all points, within 20 cm', percent],
  ['covered', 'covered', percent],
  ['nmad', 'NMAD', centimetres],
  ['faces', 'faces', String],
  ['penalty', 'penalty', (v) => (v === null ? '–' : v.toFixed(3))],
];
const PARTS = [
  ['unexplained', 'points off the roof'], ['uncovered', 'points under no roof'], ['distance', 'scatter'], ['faces', 'roof faces'],
  ['simpler', 'simpler than requested'],
];

export class Panel {
  /** @param {Units} units @param {{run: string, onclose: () => void, onfocus: (unit) => void}} wired */
  constructor(units, wired) {
    Object.assign(this, { units, wired });
    this.root = byId('panel');
    this.asked = null;
    byId('panel-close').addEventListener('click', wired.onclose);
  }

  close() {
    this.asked = null;
    this.root.hidden = true;
  }

  /** Show a building; `surface` is the class of the face that was clicked. */
  async open(id, surface = null) {
    this.asked = id;
    this.root.hidden = false;
    byId('panel-title').textContent = id;
    const body = byId('panel-body');
    body.replaceChildren(element('p', { class: 'muted' }, 'Loading …'));
    const unit = await this.units.find(id).catch(() => null);
    if (this.asked !== id) return;
    if (!unit) {
      body.replaceChildren(element('p', {}, 'The run has no record of this building; its files are of another run.'));
      return;
    }
    const ofTile = await json(`data/units/${encodeURIComponent(unit.tile || '_')}.json`).catch(() => ({}));
    const known = ofTile[id] ?? { reason: 'What is known of this building cannot be read: its file is missing or damaged.' };
    const images = known.atlas_cell ? await json(`data/images/${encodeURIComponent(known.atlas_cell)}.json`).catch(() => ({})) : {};
    if (this.asked !== id) return;
    const parts = [this.#head(unit, known, surface), this.#command(id, unit), this.#quality(unit, known), candidates(unit, known), sources(known, images[id]), attributes(known)];
    body.replaceChildren(...parts.filter(Boolean));
    this.wired.onopened?.(id, unit, known, body);
    say(`${id}: ${STATUS[unit.status][0]}${known.reason ? `, ${known.reason}` : ''}`);
  }

  #head(unit, known, surface) {
    const [word, colour] = STATUS[unit.status];
    const [judged, shade] = VERDICT[unit.verdict] ?? [null, colour];
    const doubts = known.verdict_reason === known.reason ? null : known.verdict_reason;
    return element(
      'div', {},
      element('p', { class: 'status' }, element('i', { style: `background:${shade}`, 'aria-hidden': 'true' }), element('b', {}, judged ?? word), judged ? element('span', { class: 'muted' }, ` · ${word}`) : '', surface ? element('span', { class: 'muted' }, ` · you clicked: ${titleOf(surface)}`) : ''),
      doubts ? element('p', { class: 'reason', style: `border-color:${shade}` }, doubts) : null,
      known.reason ? element('p', { class: 'reason', style: `border-color:${colour}` }, known.reason) : null,
      element(
        'div', { class: 'row' },
        element('button', { type: 'button', onclick: () => this.wired.onfocus(unit) }, 'Go there'),
        known.page ? element('a', { class: 'button', href: `../${known.page}` }, 'Its page in the report') : null,
      ),
    );
  }

  #command(id, unit) {
    const quoted = /^[\w.@%+=:,/-]+$/.test(id) ? id : `'${id.replaceAll("'", "'\\''")}'`;
    const command = unit.status === 'refused' ? `cityflow explain ${this.wired.run} ${id.startsWith('-') ? '-- ' : ''}${quoted}` : `cityflow rerun ${this.wired.run} --unit ${quoted}`;
    const field = element('input', { type: 'text', readonly: true, value: command, id: 'panel-command', 'aria-label': 'Command', onfocus: (event) => event.target.select() });
    const button = element('button', { type: 'button', onclick: (event) => copied(field, event.target) }, 'Copy');
    const why = unit.status === 'refused' ? 'Fix its outline in the source. Details:' : 'Make this building again; --set key=value after it changes a parameter of this building, --clear-overrides undoes that:';
    return element('div', { class: 'command' }, element('label', { for: 'panel-command' }, why), element('div', { class: 'row' }, field, button));
  }

  #quality(unit, known) {
    const hasModel = unit.status === 'done' || unit.status === 'degraded';
    const rows = [
      ['Method', hasModel && known.method ? words(known.method) : null], ['Level of detail', known.lod], ['Roof planes', hasModel ? known.planes : null],
      ['NMAD, scatter without outliers', unit.nmad === null ? null : centimetres(unit.nmad)], ['Probability of being good', known.good_probability === null || known.good_probability === undefined ? null : percent(known.good_probability)],
      ['RMSE, missed parts count', unit.rmse === null ? null : centimetres(unit.rmse)],
      ['Roof points within 20 cm of the model', known.share_explained === null ? null : percent(known.share_explained)],
      ['Time of reconstruction', known.seconds === undefined ? null : `${known.seconds.toFixed(2)} s`],
    ];
    return hasModel ? section('Quality', list(rows), true) : null;
  }
}

function candidates(unit, known) {
  const kept = unit.status === 'failed' ? null : known.kept;
  if (!known.scores?.length) return section('Candidates of the methods', element('p', { class: 'muted' }, 'No method was tried on it.'), true);
  const head = element('tr', {}, ['Method', ...SCORES.map(([, title]) => title)].map((title) => element('th', { scope: 'col' }, title)));
  const rows = known.scores.flatMap((score, k) => {
    const name = element('th', { scope: 'row' }, words(score.method), k === kept ? element('b', {}, ' (kept)') : '');
    const fault = score.valid ? '' : element('tr', {}, element('td', { colspan: SCORES.length + 1, class: 'fault' }, score.fault || 'no solid'));
    const shown = element('tr', { class: k === kept ? 'kept' : null, title: partsOf(score) }, name, SCORES.map(([key, , form]) => element('td', {}, score.faces ? form(score[key]) : '–')));
    return [shown, fault];
  });
  const made = known.scores[kept] && partsOf(known.scores[kept]);
  const note = element('p', { class: 'muted' }, `The lower the penalty the better; solids that are not valid come last. ${made ? `Of the kept one: ${made}.` : ''}`);
  return section('Candidates of the methods', element('div', {}, element('div', { class: 'scroll' }, element('table', {}, element('thead', {}, head), element('tbody', {}, rows))), note), true);
}

const titleOf = (surface) => (CLASSES.find(([name]) => name === surface)?.[1] ?? surface).toLowerCase();

function partsOf(score) {
  if (!score.parts) return null;
  const told = PARTS.filter(([key]) => score.parts[key]).map(([key, title]) => `${score.parts[key].toFixed(3)} ${title}`);
  return told.length && score.penalty !== null ? `${score.penalty.toFixed(3)} = ${told.join(' + ')}` : null;
}

function sources(known, images) {
  if (!known.texture) return section('Images of its texture', element('p', { class: 'muted' }, 'The run has no textures for this building.'));
  const seen = (images ?? []).filter(([, share]) => share >= LEAST_SHARE);
  const rest = (images ?? []).length - seen.length;
  const rows = [...seen.map(([name, share]) => [name, percent(share)]), ...(rest ? [[`${rest} more`, `less than ${percent(LEAST_SHARE)} each`]] : [])];
  const share = `${percent(known.texture.textured_share)} of ${known.texture.area_m2.toLocaleString('en', { maximumFractionDigits: 0 })} m² have a texture. ${known.texture.candidates} images have the building in their frame, ${known.texture.seen} see it.`;
  return section('Images of its texture', element('div', {}, element('p', { class: 'muted' }, share), rows.length ? list(rows) : ''), true);
}

function attributes(known) {
  const groups = grouped(known.attributes ?? {});
  const shown = groups.flatMap(([title, rows]) => [element('h3', {}, title), list(rows)]);
  return section('All attributes', shown.length ? element('div', {}, shown) : element('p', { class: 'muted' }, 'None.'));
}

function section(title, content, isOpen = false) {
  return element('details', { open: isOpen }, element('summary', {}, title), content);
}

function list(rows) {
  return element('dl', {}, rows.filter(([, value]) => value !== undefined && value !== null && value !== '').flatMap(([key, value]) => [element('dt', {}, key), element('dd', {}, String(value))]));
}

async function copied(field, button) {
  field.select();
  const isCopied = await copy(field.value);
  say(isCopied ? 'The command is copied.' : 'Press Ctrl+C to copy the command.');
  if (!isCopied) return;
  button.textContent = 'Copied';
  setTimeout(() => (button.textContent = 'Copy'), 1500);
}
