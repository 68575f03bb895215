// The page's elements: found by id, made from plain descriptions, and the line that is read aloud.

export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; text never becomes markup. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, '');
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return made;
}

/** Whether a text could be put where pasting takes it from. */
export async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

/** A line at the foot of the page, which screen readers read; what does not fit in it can be read by pointing at it. Where there is nothing to say it tells how to move. */
export function say(text) {
  const line = byId('status');
  line.textContent = text || hint();
  line.title = line.textContent;
}

export const hint = () => (window.matchMedia?.('(pointer: coarse)').matches
  ? 'Drag to move, two fingers turn and zoom. Tap a building to learn about it.'
  : 'Drag to move, right button to turn, wheel to come closer. Click a building to learn about it.');

export const metres = (value, digits = 2) => `${value.toFixed(digits)} m`;

export const centimetres = (value) => (value === null || value === undefined ? '–' : `${(100 * value).toFixed(1)} cm`);

export const percent = (value) => (value === null || value === undefined ? '–' : `${(100 * value).toFixed(1)} %`);
