// How faces are drawn. One shader with variants, so that photographs cost no more than in a viewer that can do nothing else.
import { BufferAttribute, Color, Matrix3, ShaderMaterial, Vector3 } from 'three';

export const PHOTOGRAPHS = 0;
export const CLASS = 1;
export const UNIT = 2;

const VERTEX = /* glsl */ `
#ifdef HAS_COLOUR
attribute vec4 color;
#define LIT color.a
#else
attribute float lit;
#define LIT lit
#endif
#ifdef IS_BUILDING
attribute float _feature_id_0;
attribute float surfaceClass;
#endif
#ifdef HAS_TRIPLETS
attribute vec3 _uvd;
#endif
uniform float selected;
uniform float leftOut;
uniform vec3 plain;
uniform vec3 classColours[8];
uniform sampler2D unitColours;
varying vec3 shade;
#if defined(HAS_MAP) && MODE == 0
  #ifdef HAS_TRIPLETS
  varying vec3 uvd;
  #else
  varying vec2 at;
  #endif
#endif
void main() {
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
  float light = 1.04 * LIT;
  shade = vec3(1.0);
#if MODE == 0
  #ifdef HAS_MAP
    #ifdef HAS_TRIPLETS
    uvd = _uvd;
    #else
    at = uv;
    #endif
  #else
    #ifdef HAS_COLOUR
    shade = color.rgb * light;
    #else
    shade = plain * light;
    #endif
  #endif
#elif MODE == 1
  shade = classColours[int(surfaceClass + 0.5)] * light;
#else
  shade = texelFetch(unitColours, ivec2(int(_feature_id_0 + 0.5), 0), 0).rgb * light;
#endif
#ifdef HAS_SELECTION
  if (abs(_feature_id_0 - selected) < 0.5) {
    shade = -shade;
    if (leftOut > 0.5) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }
#endif
}`;

// A negative shade marks the chosen building: no varying more for the many that are not.
const FRAGMENT = /* glsl */ `
uniform sampler2D page;
varying vec3 shade;
#if defined(HAS_MAP) && MODE == 0
  #ifdef HAS_TRIPLETS
  varying vec3 uvd;
  #else
  varying vec2 at;
  #endif
#endif
void main() {
#if defined(HAS_MAP) && MODE == 0
  #ifdef HAS_TRIPLETS
  vec3 colour = texture2D(page, uvd.xy / uvd.z).rgb;
  #else
  vec3 colour = texture2D(page, at).rgb;
  #endif
#else
  vec3 colour = abs(shade);
#endif
#ifdef IS_MUTED
  colour = mix(vec3(dot(colour, vec3(0.2126, 0.7152, 0.0722))), colour, 0.2) * 0.7 + 0.12;
#endif
#ifdef HAS_SELECTION
  if (shade.r + shade.g + shade.b < 0.0) colour = mix(colour, vec3(0.03, 0.3, 0.9), 0.24);
#endif
  gl_FragColor = vec4(colour, 1.0);
  #include <colorspace_fragment>
}`;

const SUN = new Vector3(-0.6, -0.45, 0.66).normalize();

/**
 * Light on each vertex, as a share of the most, in place of its normal: reckoned once and not in each frame, and kept in place of the opacity where
 * vertices have colours, which are opaque. `toPage` is the matrix from the mesh to the page's frame.
 */
export function lighten(geometry, toPage) {
  const { position, normal } = geometry.attributes;
  const isColoured = hasColours(geometry);
  const lit = isColoured ? geometry.attributes.color : new BufferAttribute(new Uint8Array(position.count).fill(255), 1, true);
  if (normal) {
    const { x, y, z } = SUN.clone().applyMatrix3(new Matrix3().setFromMatrix4(toPage).transpose());
    for (let i = 0; i < position.count; i += 1) {
      const across = x * normal.getX(i) + y * normal.getY(i) + z * normal.getZ(i);
      const share = (0.42 + 0.62 * Math.max(0, 0.25 + 0.75 * across)) / 1.04;
      if (isColoured) lit.setW(i, share);
      else lit.setX(i, share);
    }
    geometry.deleteAttribute('normal');
  }
  if (!isColoured) geometry.setAttribute('lit', lit);
}

const hasColours = ({ attributes: { color, _feature_id_0: rows } }) => Boolean(rows) && color?.itemSize === 4;

/** A material for a mesh of a tile, in the place of the loader's. */
export function materialFor(mesh, shared) {
  const { attributes } = mesh.geometry;
  const page = mesh.material.map ?? null;
  const material = new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    defines: { MODE: PHOTOGRAPHS },
    uniforms: {
      page: { value: page },
      plain: { value: plainOf(mesh, attributes) },
      selected: { value: -1 },
      leftOut: { value: 0 },
      classColours: shared.classColours,
      unitColours: { value: shared.unitColours },
    },
    side: mesh.material.side,
  });
  if (page) material.defines.HAS_MAP = '';
  if (hasColours(mesh.geometry)) material.defines.HAS_COLOUR = '';
  if (attributes.surfaceClass) material.defines.IS_BUILDING = '';
  return material;
}

/** A mesh without photographs and colours of its own: the terrain of a run without orthos. */
function plainOf(mesh, attributes) {
  return attributes._feature_id_0 ? (mesh.material.color?.clone() ?? new Color('#cfc8bb')) : new Color('#a8b193');
}

/** Switch a variant on or off; the program changes only where something did. */
export function define(material, name, value) {
  if (material.defines[name] === value || (value === undefined && !(name in material.defines))) return;
  if (value === undefined) delete material.defines[name];
  else material.defines[name] = value;
  material.needsUpdate = true;
}
