// All that is known of a chosen building.
import { STATUS } from './colours.js';
import { json } from './data.js';
import { byId, centimetres, element, percent, say } from './elements.js';

const LEAST_SHARE = 0.001;
const SCORES = [
  ['within_20cm', 'within 20 cm', percent],
  ['covered', 'covered', percent],
  ['nmad', 'NMAD', centimetres],
  ['faces', 'faces', String],
  ['penalty', 'penalty', (v) => (v === null ? '–' : v.toFixed(3))],
];
const PARTS = [
  ['unexplained', 'points off the roof'], ['uncovered', 'points under no roof'], ['distance', 'scatter'], ['faces', 'roof faces'],
  ['simpler', 'simpler than asked for'],
];

export class Panel {
  /** @param {{run: string, onclose: () => void, onfocus: (unit) => void}} wired */
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
    const unit = this.units.get(id);
    if (!unit) {
      body.replaceChildren(element('p', {}, 'The run has no record of this building; its files are of another run.'));
      return;
    }
    const known = (await json(`data/units/${encodeURIComponent(unit.tile || '_')}.json`))[id] ?? {};
    const images = known.leaf ? await json(`data/images/${encodeURIComponent(known.leaf)}.json`).catch(() => ({})) : {};
    if (this.asked !== id) return;
    body.replaceChildren(
      this.#head(unit, known, surface), this.#command(id, unit), this.#quality(unit, known), candidates(known), sources(known, images[id]), attributes(known),
    );
    say(`${id}: ${STATUS[unit.status][0]}${known.reason ? `, ${known.reason}` : ''}`);
  }

  #head(unit, known, surface) {
    const [word, colour] = STATUS[unit.status];
    return element(
      'div', {},
      element('p', { class: 'status' }, element('i', { style: `background:${colour}`, 'aria-hidden': 'true' }), element('b', {}, word), known.reason ? `: ${known.reason}` : ''),
      surface ? element('p', { class: 'muted' }, `You clicked a face of the class ${surface}.`) : null,
      element('button', { type: 'button', onclick: () => this.wired.onfocus(unit) }, 'Go there'),
    );
  }

  #command(id, unit) {
    const quoted = /^[\w.@%+=:,/-]+$/.test(id) ? id : `'${id.replaceAll("'", "'\\''")}'`;
    const command = unit.status === 'refused' ? `cityflow explain ${this.wired.run} ${quoted}` : `cityflow rerun ${this.wired.run} --unit ${quoted}`;
    const field = element('input', { type: 'text', readonly: true, value: command, id: 'panel-command', 'aria-label': 'Command', onfocus: (event) => event.target.select() });
    const copy = element('button', { type: 'button', onclick: () => copied(field) }, 'Copy');
    const why = unit.status === 'refused' ? 'Mend it in the source. What is known of it:' : 'Run this building again (add --set key=value to change a parameter):';
    return element('div', { class: 'command' }, element('label', { for: 'panel-command' }, why), element('div', { class: 'row' }, field, copy));
  }

  #quality(unit, known) {
    const rows = [
      ['Method', known.method], ['Level of detail', known.lod], ['Roof planes', known.planes], ['NMAD of points to roof', centimetres(unit.nmad)],
      ['RMSE', centimetres(unit.rmse)], ['Points explained', percent(known.share_explained)],
      ['Time', known.seconds === undefined ? null : `${known.seconds.toFixed(2)} s`],
    ];
    return section('Quality', list(rows), true);
  }
}

function candidates(known) {
  if (!known.scores?.length) return section('Candidates', element('p', { class: 'muted' }, 'No candidates are recorded.'));
  const head = element('tr', {}, ['Method', ...SCORES.map(([, title]) => title)].map((title) => element('th', { scope: 'col' }, title)));
  const rows = known.scores.flatMap((score, k) => {
    const name = element('th', { scope: 'row' }, breakable(score.method), k === known.kept ? element('b', {}, ' (kept)') : '');
    const fault = score.valid ? '' : element('tr', {}, element('td', { colspan: SCORES.length + 1, class: 'fault' }, score.fault || 'no solid'));
    const shown = element('tr', { class: k === known.kept ? 'kept' : null, title: partsOf(score) }, name, SCORES.map(([key, , form]) => element('td', {}, form(score[key]))));
    return [shown, fault];
  });
  const note = element('p', { class: 'muted' }, 'A penalty is better the lower it is; validity comes first. Point at a row to see what its penalty is made of.');
  return section('Candidates of the methods', element('div', {}, element('div', { class: 'scroll' }, element('table', {}, element('thead', {}, head), element('tbody', {}, rows))), note), true);
}

/** A name that may be broken after its underscores, and nowhere else. */
function breakable(name) {
  return name.split(/(?<=[_/])/).flatMap((part) => [part, element('wbr')]);
}

function partsOf(score) {
  if (!score.parts) return null;
  const told = PARTS.filter(([key]) => score.parts[key]).map(([key, title]) => `${score.parts[key].toFixed(4)} ${title}`);
  return `${score.penalty.toFixed(4)} = ${told.join(' + ')}`;
}

function sources(known, images) {
  if (!known.texture) return section('Images', element('p', { class: 'muted' }, 'The run has no textures for this building.'));
  const seen = (images ?? []).filter(([, share]) => share >= LEAST_SHARE);
  const rest = (images ?? []).length - seen.length;
  const rows = [...seen.map(([name, share]) => [name, percent(share)]), ...(rest ? [[`${rest} more`, `less than ${percent(LEAST_SHARE)} each`]] : [])];
  const said = `${percent(known.texture.textured_share)} of ${known.texture.area_m2} m² have a texture; ${known.texture.candidates} images have the building in their frame, ${known.texture.seen} see it.`;
  return section('Images that textured it', element('div', {}, element('p', { class: 'muted' }, said), rows.length ? list(rows) : ''), true);
}

function attributes(known) {
  const rows = Object.entries(known.attributes ?? {}).map(([key, value]) => [key, typeof value === 'number' ? String(Math.round(value * 1e4) / 1e4) : value]);
  return section('All attributes', rows.length ? list(rows) : element('p', { class: 'muted' }, 'None.'));
}

function section(title, content, isOpen = false) {
  return element('details', { open: isOpen }, element('summary', {}, title), content);
}

function list(rows) {
  return element('dl', {}, rows.filter(([, value]) => value !== undefined && value !== null && value !== '').flatMap(([key, value]) => [element('dt', {}, key), element('dd', {}, String(value))]));
}

async function copied(field) {
  field.select();
  try {
    await navigator.clipboard.writeText(field.value);
    say('Copied.');
  } catch {
    say('Press Ctrl+C to copy the command.');
  }
}
