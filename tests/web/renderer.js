// A renderer of three.js that fills the page: WebGPURenderer, or WebGLRenderer.
import { WebGLRenderer } from 'three';

export async function rendererOf(isWebGPU) {
  let renderer;
  if (isWebGPU) {
    const { WebGPURenderer } = await import('three/webgpu');
    renderer = new WebGPURenderer();
    await renderer.init();
    if (!renderer.backend.isWebGPUBackend) throw new Error('no WebGPU here');
  } else renderer = new WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setSize(innerWidth, innerHeight);
  document.body.append(renderer.domElement);
  return renderer;
}
