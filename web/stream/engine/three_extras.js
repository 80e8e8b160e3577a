// Of MeshletStream in three.js what the first picture does without: colours of levels, and estimates of
// memory.
import { Color, MeshStandardMaterial } from 'three';

const GOLDEN_RATIO = 0.618034;

// So many materials that show colours in place of a material.
export function paletteOf({ side }, { attributes }, count) {
  return Array.from({ length: count }, (_, i) => {
    const hue = (i * GOLDEN_RATIO) % 1;
    const color = new Color().setHSL(hue, 0.5 + 0.1 * (i % 4), 0.3 + 0.08 * (i % 3));
    return new MeshStandardMaterial({
      color,
      roughness: 0.75,
      side,
      flatShading: !attributes.normal,
    });
  });
}

// Estimated bytes of an object's textures, and those of geometry that is not streamed.
export function bytesBesides(root) {
  const seen = new Set();
  let textures = 0;
  let others = 0;
  root.traverse((mesh) => {
    for (const material of [mesh.material ?? []].flat())
      for (const value of Object.values(material))
        if (value?.isTexture && !seen.has(value.source)) {
          seen.add(value.source);
          const { width = 0, height = 0 } = value.image ?? {};
          textures += (width * height * 4 * 4) / 3; // with mipmaps
        }
    const { geometry } = mesh;
    if (!geometry || mesh.isStreamed || seen.has(geometry)) return;
    seen.add(geometry);
    for (const attribute of [geometry.index, ...Object.values(geometry.attributes)])
      others += 2 * (attribute?.array?.byteLength ?? 0);
  });
  return { textureBytes: Math.round(textures), otherBytes: others };
}
