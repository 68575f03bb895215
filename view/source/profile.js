// Draws a section: points by class, the model's and the terrain's lines over them, with a scale for both directions.
import { POINT_CLASSES, UNKNOWN } from './colours.js';

const MARGIN = { left: 52, right: 14, top: 12, bottom: 30 };
const BELOW_M = 3;
const ABOVE_M = 12;
export const LINES = { buildings: ['#c2185b', 2], terrain: ['#6d4c1e', 1.5] };

/** @returns {{exaggeration: number}} of heights against lengths */
export function drawProfile(canvas, { points, lines, length, lift }) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext('2d');
  pen.scale(ratio, ratio);
  const style = getComputedStyle(canvas);
  pen.fillStyle = style.backgroundColor;
  pen.fillRect(0, 0, width, height);
  const [low, high] = range(points, lines);
  const across = (width - MARGIN.left - MARGIN.right) / length;
  const room = (height - MARGIN.top - MARGIN.bottom) / (high - low);
  const up = room >= across ? across : room;
  const [right, rise] = room >= across ? [across, across] : [across, up];
  const base = height - MARGIN.bottom;
  const x = (s) => MARGIN.left + s * right;
  const y = (z) => base - (z - low) * rise;
  axes(pen, { x, y, low, high: low + (base - MARGIN.top) / rise, length, lift, width, ink: style.color });
  pen.save();
  pen.beginPath();
  pen.rect(MARGIN.left, MARGIN.top, width - MARGIN.left - MARGIN.right, base - MARGIN.top);
  pen.clip();
  for (const [s, z, kind, rgb] of points) {
    pen.fillStyle = rgb ? `rgb(${rgb.join()})` : (POINT_CLASSES[kind]?.[1] ?? UNKNOWN);
    pen.fillRect(x(s) - 1, y(z) - 1, 2, 2);
  }
  for (const [part, [colour, weight]] of Object.entries(LINES).reverse()) {
    pen.strokeStyle = colour;
    pen.lineWidth = weight;
    pen.beginPath();
    for (const [s0, z0, s1, z1, of] of lines) {
      if (of !== part) continue;
      pen.moveTo(x(s0), y(z0));
      pen.lineTo(x(s1), y(z1));
    }
    pen.stroke();
  }
  pen.restore();
  const text = `Section of ${length.toFixed(1)} metres: ${points.length} points; heights from ${(low + lift).toFixed(1)} to ${(high + lift).toFixed(1)} metres`;
  canvas.setAttribute('aria-label', text);
  return { exaggeration: rise / right };
}

/** Lowest and highest that is drawn: all of the model, and points near it; blunders far above or below would flatten the rest. */
function range(points, lines) {
  const model = lines.flatMap(([, z0, , z1]) => [z0, z1]);
  const heights = points.map(([, z]) => z).sort((a, b) => a - b);
  const known = model.length ? model : [0.02, 0.98].map((share) => heights[Math.floor(share * (heights.length - 1))]);
  if (!known.length || known.includes(undefined)) return [0, 1];
  const [bottom, top] = known.reduce(([l, h], z) => [Math.min(l, z), Math.max(h, z)], [Infinity, -Infinity]);
  const near = heights.filter((z) => z > bottom - BELOW_M && z < top + ABOVE_M);
  const [low, high] = [Math.min(bottom, near[0] ?? bottom), Math.max(top, near.at(-1) ?? top)];
  const margin = 0.05 * (high - low) + 0.5;
  return [low - margin, high + margin];
}

function axes(pen, { x, y, low, high, length, lift, width, ink }) {
  pen.strokeStyle = '#8886';
  pen.fillStyle = ink;
  pen.font = '11px system-ui, sans-serif';
  pen.lineWidth = 1;
  pen.textAlign = 'center';
  for (const s of ticks(0, length, 8)) {
    line(pen, x(s), y(low), x(s), y(high));
    pen.fillText(`${s} m`, x(s), y(low) + 16);
  }
  pen.textAlign = 'right';
  for (const z of ticks(low + lift, high + lift, 5)) {
    line(pen, x(0), y(z - lift), width - MARGIN.right, y(z - lift));
    pen.fillText(`${z} m`, x(0) - 6, y(z - lift) + 4);
  }
}

function line(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

/** Round numbers between two, about `wanted` of them. */
export function ticks(low, high, wanted) {
  const raw = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k += 1) found.push(Number((k * step).toPrecision(12)));
  return found;
}
