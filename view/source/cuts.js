// Cut lines: which one is under the pointer, and what is known of it.
import { Vector3 } from 'three';

const REACH_PX = 7;

/** Places along a cut line, from end to end: it lies on the roofs that it parts. */
export function pathOf({ from, to, heights }) {
  return heights.map((up, i) => {
    const share = i / (heights.length - 1);
    return [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), up];
  });
}

/** The cut line that is drawn within some pixels of the pointer. */
export function pickCut({ layers, stage }, { clientX, clientY }) {
  let best = REACH_PX;
  let found = null;
  for (const { userData } of layers.objects('cuts')) {
    for (const cut of userData.cuts ?? []) {
      const path = pathOf(cut).map((p) => stage.onPage(new Vector3(...p)));
      for (let i = 1; i < path.length; i += 1) {
        if (!path[i - 1] || !path[i]) continue;
        const away = distanceToSegment([clientX, clientY], path[i - 1], path[i]);
        if (away < best) [best, found] = [away, cut];
      }
    }
  }
  return found;
}

export function distanceToSegment(p, a, b) {
  const way = [b[0] - a[0], b[1] - a[1]];
  const t = Math.min(Math.max(((p[0] - a[0]) * way[0] + (p[1] - a[1]) * way[1]) / (way[0] ** 2 + way[1] ** 2 || 1), 0), 1);
  return Math.hypot(p[0] - a[0] - t * way[0], p[1] - a[1] - t * way[1]);
}

/** Title, and rows of evidence. */
export function evidenceOf(cut) {
  const title = cut.accepted ? 'Cut line' : 'Candidate of a cut line, not taken';
  return [title, [
    ['Outline', cut.outline], ['Kind', cut.kind.replaceAll('_', ' ')], ['Confidence', cut.confidence.toFixed(2)],
    ['Upright edges, of the façade’s height', `${(100 * cut.vertical).toFixed(0)} %`], ['Edges on the roof, of the line', `${(100 * cut.sloped).toFixed(0)} %`],
    ['Roofs differ by', `${cut.height_step_m.toFixed(2)} m`], ...(cut.gap_m ? [['Gap', `${cut.gap_m.toFixed(2)} m`]] : []),
  ]];
}
