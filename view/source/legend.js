// What the colours mean.
import { CLASSES, CUTS, POINT_CLASSES, RELIEF_GRADIENT, SCALE_GRADIENT, STATUS, UNKNOWN, VERDICT } from './colours.js';
import { byId, element } from './elements.js';

const TITLES = { nmad: 'NMAD of the roof\'s points', rmse: 'RMSE of the roof\'s points' };

export function drawLegend(box, mode, { about, city }) {
  box.replaceChildren(...entries(mode, about, city));
  box.hidden = !box.childElementCount;
}

function entries(mode, about, city) {
  if (mode === 'classes') return CLASSES.filter(([name]) => name !== 'Window' || city.hasClass(name)).map(([, title, colour]) => key(colour, title));
  if (mode === 'status') return Object.entries(STATUS).map(([name, [title, colour]]) => key(colour, `${title}: ${(about.counts[name] ?? 0).toLocaleString('en')}`));
  if (mode === 'verdict') return [...Object.entries(VERDICT).map(([name, [title, colour]]) => key(colour, `${title}: ${(about.verdicts[name] ?? 0).toLocaleString('en')}`)), key(UNKNOWN, 'no verdict')];
  if (!(mode in TITLES)) return [];
  return [
    element('p', {}, TITLES[mode]),
    element('div', { class: 'scale', style: `background:${SCALE_GRADIENT}` }),
    element('p', { class: 'ends' }, element('span', {}, '0 cm'), element('span', {}, `${(100 * about.scales[mode]).toFixed(0)} cm and more`)),
    key(UNKNOWN, 'not measured'),
    ...(mode === 'rmse' ? [element('p', { class: 'muted' }, 'Points on parts that a model lacks count here: one such part makes a building yellow whose planes fit within centimetres. How far points scatter about the planes is the NMAD.')] : []),
  ];
}

/** What the colours of a layer mean, below its box; nothing where there is nothing to say. */
export function drawLayerLegend(name, isShown, { about }) {
  const box = byId(`${name}-legend`);
  box.replaceChildren(...(isShown ? LAYERS[name](about) : []));
  box.hidden = !box.childElementCount;
}

const LAYERS = {
  points: (about) => {
    const isByClass = about.tiles.some((tile) => tile.points && !tile.points.is_coloured);
    const words = new Map(Object.values(POINT_CLASSES).map(([title, colour]) => [title, colour]));
    return isByClass ? [...words].map(([title, colour]) => key(colour, title)) : [];
  },
  dsm: ({ heights: [low, high] }) => [
    element('div', { class: 'scale', style: `background:${RELIEF_GRADIENT}` }),
    element('p', { class: 'ends' }, ...[low, high].map((v) => element('span', {}, `${Math.round(v) || 0} m`))),
  ],
  cuts: () => Object.values(CUTS).map(([title, colour]) => key(colour, title)),
  failures: ({ counts }) => ['failed', 'refused'].filter((name) => counts[name]).map((name) => key(STATUS[name][1], `${STATUS[name][0]}: ${counts[name].toLocaleString('en')}`)),
};

export function key(colour, text) {
  return element('p', { class: 'key' }, element('i', { style: `background:${colour}`, 'aria-hidden': 'true' }), text);
}
