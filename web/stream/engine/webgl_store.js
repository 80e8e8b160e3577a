// Decoded pages of a pool in buffers of WebGL, without a copy of them in arrays.

const COPY_MS = 1000; // that a copy is kept after the last call that needs it

// What a pool calls is in core/moves.js.
export class WebGLStore {
  #gl;
  #types; // of arrays; the last one is the index
  #lengths = [];
  #changed;
  #copies = new Map(); // number -> what it holds, as long as somebody needs it
  #timer;
  buffers = [];
  writes = 0;

  // changed(lengths): called with new buffers.
  constructor(gl, formats, changed) {
    this.#gl = gl;
    this.#types = [...formats.map(({ Type }) => Type), Uint32Array];
    this.#changed = changed;
  }

  resize(lengths) {
    const gl = this.#gl;
    const vertexArray = gl.getParameter(gl.VERTEX_ARRAY_BINDING);
    gl.bindVertexArray(null);
    this.buffers = lengths.map((length, a) =>
      length === this.#lengths[a] ? this.buffers[a] : this.#resized(a, length),
    );
    gl.bindVertexArray(vertexArray);
    this.#lengths = lengths;
    this.#write();
    this.#changed(lengths);
  }

  // Another buffer with what the one before held.
  #resized(a, length) {
    const gl = this.#gl;
    const before = this.buffers[a];
    const bytes = this.#types[a].BYTES_PER_ELEMENT;
    const isIndex = a === this.#types.length - 1;
    const target = isIndex ? gl.ELEMENT_ARRAY_BUFFER : gl.COPY_WRITE_BUFFER; // which it stays
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, bytes * length, gl.DYNAMIC_DRAW);
    if (before) {
      const kept = bytes * Math.min(length, this.#lengths[a]);
      gl.bindBuffer(gl.COPY_READ_BUFFER, before);
      gl.copyBufferSubData(gl.COPY_READ_BUFFER, target, 0, 0, kept);
      gl.bindBuffer(gl.COPY_READ_BUFFER, null);
      gl.deleteBuffer(before);
    }
    gl.bindBuffer(target, null);
    return buffer;
  }

  #write() {
    this.writes++;
    this.#copies.clear();
  }

  write(a, begin, part) {
    const gl = this.#gl;
    gl.bindBuffer(gl.COPY_WRITE_BUFFER, this.buffers[a]);
    gl.bufferSubData(gl.COPY_WRITE_BUFFER, begin * part.BYTES_PER_ELEMENT, part);
    gl.bindBuffer(gl.COPY_WRITE_BUFFER, null);
    this.#write();
  }

  // Waits for the GPU.
  read(a, begin, end) {
    const gl = this.#gl;
    const part = new this.#types[a](end - begin);
    gl.bindBuffer(gl.COPY_READ_BUFFER, this.buffers[a]);
    gl.getBufferSubData(gl.COPY_READ_BUFFER, begin * part.BYTES_PER_ELEMENT, part);
    gl.bindBuffer(gl.COPY_READ_BUFFER, null);
    return part;
  }

  // All that a buffer holds; read once until it is written again.
  copy(a) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#copies.clear(), COPY_MS);
    if (!this.#copies.has(a)) this.#copies.set(a, this.read(a, 0, this.#lengths[a]));
    return this.#copies.get(a);
  }

  release() {
    clearTimeout(this.#timer);
    this.#copies.clear();
    for (const buffer of this.buffers) this.#gl.deleteBuffer(buffer);
    this.buffers = [];
  }
}
