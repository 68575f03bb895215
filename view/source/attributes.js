// What is said of a building in words and units that people use; attributes that the source brought keep their own names.

const metres = (v) => `${v.toFixed(2)} m`;
const squares = (v) => `${v.toFixed(1)} m²`;
const cubes = (v) => `${v.toFixed(1)} m³`;
const cents = (v) => `${(100 * v).toFixed(1)} cm`;
const share = (v) => `${(100 * v).toFixed(1)} %`;
const count = (v) => v.toLocaleString('en');

const GROUPS = [
  ['Size', [
    ['ridge_height_m', 'Ridge, above the height datum', metres], ['eave_height_m', 'Lowest eave', metres], ['ground_height_m', 'Floor', metres],
    ['roof_height_p95_m', '95 % of the roof is below', metres], ['roof_height_p70_m', '70 % is below', metres], ['roof_height_p50_m', 'Half is below', metres],
    ['roof_height_p05_m', '5 % is below', metres],
    ['footprint_area_m2', 'Footprint', squares], ['roof_area_m2', 'Roof', squares], ['wall_area_m2', 'Walls', squares], ['outer_wall_area_m2', 'Outer walls', squares],
    ['shared_wall_area_m2', 'Walls shared with neighbours', squares], ['volume_m3', 'Volume', cubes],
    ['overhang_mean_m', 'Overhang of the eaves, mean', metres], ['overhang_max_m', 'largest', metres],
  ]],
  ['Shape', [
    ['roof_type', 'Roof', words], ['roof_faces', 'Roof faces', count], ['planes', 'Roof planes', count], ['lod', 'Level of detail', String],
    ['outline_remark', 'Outline', String],
  ]],
  ['Façades', [
    ['storeys', 'Storeys, by the source', count], ['storeys_by_windows', 'Storeys, by rows of windows', count], ['windows', 'Windows', count], ['window_to_wall_ratio', 'Window-to-wall ratio', share],
    ['windows_seen_share', 'Walls searched for windows', share], ['windows_confidence', 'Windows, mean confidence', share], ['windows_missing', 'No windows because', String],
    ['window_to_wall_missing', 'No window-to-wall ratio because', String],
    ['textured_share', 'Faces with a photograph', share], ['texture_interpolated', 'of these, interpolated', share], ['texture_gsd_m', 'Size of a pixel', cents],
  ]],
  ['Measured points', [
    ['roof_points', 'On the roof', count], ['points_per_m2', 'Density', (v) => `${v.toFixed(1)} per m²`], ['share_explained', 'Within 20 cm of the model', share],
    ['share_covered', 'With a roof face above or below', share], ['bias', 'Mean height above the model', cents], ['nmad', 'NMAD (scatter without outliers)', cents],
    ['rmse', 'RMSE (missed parts count)', cents], ['le95', '95 % are within', cents], ['claimed_rmse_m', 'Expected RMSE of the model', cents],
    ['held_back_points', 'Held back from the fit', count], ['held_back_off_share', 'of them more than 20 cm off', share], ['roof_off_share', 'Roof more than 20 cm off by points', share],
    ['roof_unseen_share', 'Roof without points nearby', share],
    ['points_facade', 'Not on the roof: façades', count], ['points_above_roof', 'Not on the roof: above it', count], ['points_below_roof', 'Not on the roof: below it', count], ['points_near_ground', 'Not on the roof: near the ground', count],
  ]],
];
const TOLD_ELSEWHERE = new Set(['method', 'kept', 'source', 'source_date', 'verdict', 'verdict_reason', 'good_probability']);
const DATED = [['source', 'Survey', String], ['source_date', 'Flown', String]];

/** 'orientation_histogram' → 'orientation histogram'. */
export function words(name) {
  return String(name).replaceAll('_', ' ');
}

/** Titles and rows of attributes; those of the source come last. */
export function grouped(attributes) {
  const known = new Set([...TOLD_ELSEWHERE, ...GROUPS.flatMap(([, entries]) => entries.map(([key]) => key))]);
  const groups = [...GROUPS, ['Survey', DATED]].map(([title, entries]) => [title, entries.flatMap(([key, name, form]) => (isKnown(attributes[key]) ? [[name, formed(attributes[key], form)]] : []))]);
  const own = Object.entries(attributes).filter(([key, value]) => !known.has(key) && isKnown(value)).map(([key, value]) => [key, typeof value === 'number' ? String(Math.round(value * 1e4) / 1e4) : String(value)]);
  return [...groups, ['Attributes of the outline\'s source', own]].filter(([, rows]) => rows.length);
}

const isKnown = (value) => value !== null && value !== undefined && value !== '';

function formed(value, form) {
  return typeof value === 'number' || form === String || form === words ? form(value) : String(value);
}
