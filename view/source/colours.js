// Colours with a meaning. The scale is readable with every kind of colour vision: dark blue, green, yellow.

export const CLASSES = [
  ['GroundSurface', 'Floor', '#7a6a55'],
  ['RoofSurface', 'Roof', '#c0483c'],
  ['WallSurface', 'Wall', '#d8cfbf'],
  ['OuterCeilingSurface', 'Underside', '#6b7fa3'],
  ['OuterFloorSurface', 'Outer floor', '#a8946f'],
  ['Window', 'Window', '#5db4e0'],
];

export const STATUS = {
  done: ['Done', '#2f9e8f'],
  degraded: ['Simplified', '#e0a030'],
  failed: ['Failed', '#d62f2f'],
  refused: ['Refused', '#8a1c5c'],
};

export const VERDICT = {
  good: ['Good', '#2a8c63'],
  look: ['To look at', '#e0a030'],
  poor: ['Poor', '#d62f2f'],
};

export const UNKNOWN = '#9a9a9a';

export const POINT_CLASSES = {
  1: ['Unclassified', '#b0b0b0'], 2: ['Ground', '#b39b75'], 3: ['Vegetation', '#2e7d5b'], 4: ['Vegetation', '#2e7d5b'],
  5: ['Vegetation', '#2e7d5b'], 6: ['Building', '#e8743b'], 9: ['Water', '#4a90d9'], 17: ['Bridge', '#888844'],
};

export const CUTS = { taken: ['Taken', '#0b6bff'], refused: ['Candidate, not taken', '#f59f00'] };

const SCALE = ['#30216b', '#2f5f8f', '#1f948a', '#63c95b', '#fde33a'];
const RELIEF = ['#4d8577', '#93a878', '#d3bf86', '#efe6da'];
const DIVERGING = ['#2455a4', '#7fb2dd', '#f2f2f2', '#f0a070', '#b2182b'];

export function rgb(hex) {
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
}

/** A colour on the scale, 0 to 1. */
export const scaled = (share) => between(SCALE, share);

/** A colour for what is too low (−1, blue) or too high (1, red). */
export const diverging = (share) => between(DIVERGING, (share + 1) / 2);

/** A colour for a height between the lowest, 0, and the highest, 1. */
export const relief = (share) => between(RELIEF, share);

export const gradient = (stops) => `linear-gradient(to right, ${stops.join(', ')})`;
export const SCALE_GRADIENT = gradient(SCALE);
export const RELIEF_GRADIENT = gradient(RELIEF);
export const DIVERGING_GRADIENT = gradient(DIVERGING);

function between(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(place), stops.length - 2);
  const [a, b] = [rgb(stops[low]), rgb(stops[low + 1])];
  return a.map((v, i) => Math.round(v + (b[i] - v) * (place - low)));
}
