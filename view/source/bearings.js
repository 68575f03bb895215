// Where north is, and how long a metre is in the middle of the picture.
import { MathUtils, Vector3 } from 'three';
import { byId } from './elements.js';

const MOST_PX = 130;
const ROUND = [1, 2, 5];

/** Keep needle and bar right while one moves. */
export function showBearings(stage) {
  const draw = () => {
    const ahead = stage.camera.getWorldDirection(new Vector3());
    byId('needle').style.transform = `rotate(${-MathUtils.radToDeg(Math.atan2(ahead.x, ahead.y)).toFixed(1)}deg)`;
    const perPixel = metresPerPixel(stage);
    const metres = roundBelow(MOST_PX * perPixel);
    byId('scale-bar').style.width = `${(metres / perPixel).toFixed(0)}px`;
    byId('scale-text').textContent = metres < 1 ? `${Math.round(100 * metres)} cm` : `${metres.toLocaleString('en')} m`;
    byId('bearings').setAttribute('aria-label', `North is ${Math.round((360 - MathUtils.radToDeg(Math.atan2(ahead.x, ahead.y))) % 360)} degrees clockwise from up`);
  };
  stage.afterMove.push(draw);
  draw();
}

/** In the middle of the picture, at the distance of what one looks at. */
function metresPerPixel({ camera, controls, size }) {
  const away = Math.max(camera.position.distanceTo(controls.target), 1);
  return (2 * away * Math.tan(MathUtils.degToRad(camera.fov / 2))) / size[1];
}

/** The greatest of 1, 2, 5 times a power of ten that is no more than a length. */
export function roundBelow(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return Math.max(...ROUND.map((r) => r * power).filter((v) => v <= length * 1.0001));
}
