// Loses the WebGL context of a canvas, or the WebGPU device of a renderer of three.js, as drivers do,
// and draws some frames without it, with numbers from 0 to 1.
const FRAMES = 20;

async function drawFrames(draw) {
  for (let i = 0; i <= FRAMES; i++) {
    draw(i / FRAMES);
    await new Promise(requestAnimationFrame);
  }
}

// Waits until the context is back.
export async function loseContext(canvas, draw) {
  const driver = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
  driver.loseContext();
  await drawFrames(draw);
  const restored = new Promise((resolve) => {
    canvas.addEventListener('webglcontextrestored', () => setTimeout(resolve)); // after the engine
  });
  driver.restoreContext();
  await restored;
}

// A device never comes back. loseGpu is of screenshots.mjs.
export async function loseDevice(renderer, draw) {
  const lost = new Promise((resolve) => {
    renderer.onDeviceLost = resolve;
  });
  await window.loseGpu();
  await lost;
  await drawFrames(draw);
  await renderer.dispose();
}
