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
    ['footprint_area_m2', 'Footprint', squares], ['roof_area_m2', 'Roof', squares], ['wall_area_m2', 'Walls', squares], ['outer_wall_area_m2', 'Walls to the open', squares],
    ['shared_wall_area_m2', 'Walls shared with neighbours', squares], ['volume_m3', 'Volume', cubes],
    ['overhang_mean_m', 'Eaves reach beyond the walls by', metres], ['overhang_max_m', 'at most by', metres],
  ]],
  ['Shape', [
    ['roof_type', 'Roof', words], ['roof_faces', 'Roof faces', count], ['planes', 'Roof planes', count], ['lod', 'Level of detail', String],
    ['outline_remark', 'Outline', String],
  ]],
  ['Façades', [
    ['storeys', 'Storeys, by the source', count], ['storeys_by_windows', 'Storeys, by rows of windows', count], ['windows', 'Windows', count], ['window_to_wall_ratio', 'Windows of the walls', share],
    ['windows_seen_share', 'Walls looked at for windows', share], ['windows_confidence', 'Windows, mean confidence', share], ['windows_missing', 'No windows known', String],
    ['window_to_wall_missing', 'No share of windows', String],
    ['textured_share', 'Faces with a photograph', share], ['texture_interpolated', 'of that, filled in', share], ['texture_gsd_m', 'Size of a pixel', cents],
  ]],
  ['Measured points', [
    ['roof_points', 'On the roof', count], ['points_per_m2', 'Density', (v) => `${v.toFixed(1)} per m²`], ['share_explained', 'Within 20 cm of the model', share],
    ['share_covered', 'Above or below a roof of it', share], ['bias', 'Mean above the model', cents], ['nmad', 'NMAD (scatter without outliers)', cents],
    ['rmse', 'RMSE (missed parts count)', cents], ['le95', '95 % are within', cents], ['claimed_rmse_m', 'Model claims to be right within', cents],
    ['held_back_points', 'Held back from the fit', count], ['held_back_off_share', 'of them more than 20 cm off', share], ['roof_off_share', 'Roof that points say is off', share],
    ['roof_unseen_share', 'Roof with no point near', share],
    ['points_facade', 'No roof: of façades', count], ['points_above_roof', 'No roof: above it', count], ['points_below_roof', 'No roof: below it', count], ['points_near_ground', 'No roof: near the ground', count],
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
  return [...groups, ['Of the outline, as its source says', own]].filter(([, rows]) => rows.length);
}

const isKnown = (value) => value !== null && value !== undefined && value !== '';

function formed(value, form) {
  return typeof value === 'number' || form === String || form === words ? form(value) : String(value);
}
