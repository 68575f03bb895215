// What of the stage no panel covers: the city is shown in the middle of that.
import { byId } from './elements.js';

const GAP_PX = 12;
const NARROW = window.matchMedia('(max-width: 760px)');

/** Tell the stage, now and whenever a panel opens, closes or changes its size; returns what tells it without waiting for that. */
export function keepClear(stage) {
  const tell = (isAtOnce) => stage.coverBy(covered(), isAtOnce);
  tell(true);
  const observer = new ResizeObserver(() => tell(false));
  for (const id of ['layers', 'panel', 'profile']) observer.observe(byId(id));
  NARROW.addEventListener('change', () => tell(true));
  return tell;
}

function covered() {
  const [layers, panel, profile] = ['layers', 'panel', 'profile'].map((id) => byId(id));
  const across = (element) => (element.offsetWidth ? element.offsetWidth + GAP_PX : 0);
  const upright = (element) => (element.offsetHeight ? element.offsetHeight + GAP_PX : 0);
  if (NARROW.matches) return { left: 0, right: 0, top: 0, bottom: Math.max(upright(panel), upright(profile)) };
  return { left: across(layers), right: across(panel), top: 0, bottom: upright(profile) };
}
