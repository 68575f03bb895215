// What the colours mean.
import { CLASSES, POINT_CLASSES, SCALE_GRADIENT, STATUS, UNKNOWN } from './colours.js';
import { element } from './elements.js';

const TITLES = { nmad: 'NMAD of the points to their roof', rmse: 'RMSE of the points to their roof' };

export function drawLegend(box, mode, { about, city }) {
  box.replaceChildren(...entries(mode, about, city));
  box.hidden = !box.childElementCount;
}

function entries(mode, about, city) {
  if (mode === 'classes') return CLASSES.filter(([name]) => name !== 'Window' || city.hasClass(name)).map(([, title, colour]) => key(colour, title));
  if (mode === 'status') return Object.entries(STATUS).map(([name, [title, colour]]) => key(colour, `${title}: ${(about.counts[name] ?? 0).toLocaleString('en')}`));
  if (!(mode in TITLES)) return [];
  return [
    element('p', {}, TITLES[mode]),
    element('div', { class: 'scale', style: `background:${SCALE_GRADIENT}` }),
    element('p', { class: 'ends' }, element('span', {}, '0 cm'), element('span', {}, `${(100 * about.scales[mode]).toFixed(0)} cm and more`)),
    key(UNKNOWN, 'not measured'),
  ];
}

/** Colours of points by class; nothing where points have the colours of photographs. */
export function drawPointLegend(box, isShown, { about }) {
  const isByClass = about.tiles.some((tile) => tile.points && !tile.points.is_coloured);
  const words = new Map(Object.values(POINT_CLASSES).map(([title, colour]) => [title, colour]));
  box.replaceChildren(...[...words].map(([title, colour]) => key(colour, title)));
  box.hidden = !isShown || !isByClass;
}

export function key(colour, text) {
  return element('p', { class: 'key' }, element('i', { style: `background:${colour}`, 'aria-hidden': 'true' }), text);
}
