// The middle of what no panel covers, marked while somebody measures with the keyboard: Enter takes the place that is seen there.
import { byId } from './elements.js';

export function markMiddle(stage, tools) {
  const mark = byId('aim');
  let isByKeys = false;
  const note = (isKey) => {
    if (isKey === isByKeys) return;
    isByKeys = isKey;
    stage.changed();
  };
  window.addEventListener('keydown', () => note(true), true);
  window.addEventListener('pointermove', ({ movementX, movementY }) => (movementX || movementY) && note(false), true);
  stage.beforeFrame.push(() => {
    mark.hidden = !(isByKeys && tools.active);
    if (mark.hidden) return;
    const { left, top } = stage.canvas.getBoundingClientRect();
    const { clientX, clientY } = stage.middle;
    mark.style.transform = `translate(${clientX - left}px, ${clientY - top}px)`;
  });
}
