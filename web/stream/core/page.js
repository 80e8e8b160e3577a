// A page of a primitive: what of it is in memory. Only this file changes that.
//
// | event   | from            | to        | what happens                                             |
// | ------- | --------------- | --------- | -------------------------------------------------------- |
// | request | NONE            | REQUESTED | its bytes are on the way                                 |
// | fail    | REQUESTED       | NONE      | they do not come, or are not wanted any more             |
// | arrive  | NONE, REQUESTED | STORED    | its compressed bytes are there                           |
// | forget  | STORED          | NONE      | they are not there any more                              |
// | decode  | STORED          | DECODING  | a Worker has it                                          |
// | spoil   | DECODING        | NONE      | its bytes are malformed, or the Worker died; forgets them |
// | finish  | DECODING        | DECODED   | it waits for its place                                   |
// | dismiss | DECODED         | STORED    | nothing needs it any more                                |
// | insert  | DECODED         | RESIDENT  | it lies in a pool, and can be drawn                      |
// | move    | RESIDENT        | RESIDENT  | it lies elsewhere in its pool                            |
// | forget  | RESIDENT        | RESIDENT  | the same                                                 |
// | evict   | RESIDENT        | STORED    | its place is free; without bytes it is NONE              |
import { Attempts } from './attempts.js';
import { chunksOf } from './geometry.js';

export const NONE = 0;
export const REQUESTED = 1;
export const STORED = 2;
export const DECODING = 3;
export const DECODED = 4;
export const RESIDENT = 5;

export class Page {
  #state = NONE;
  #bytes = null; // compressed
  #place = null; // in the pool
  #wanted = 0; // pixels of error without it; 0: not wanted
  #used = 0; // frame in which it was needed last
  attempts = new Attempts();

  // owner: its primitive. Its bytes are `length` ones from `begin` on in `source`; packed: number of
  // unpacked bytes, or 0.
  constructor(owner, number, { source, begin, length, packed, vertices, triangles }) {
    this.owner = owner;
    this.number = number;
    this.source = source;
    this.begin = begin;
    this.length = length;
    this.packed = packed;
    this.vertices = vertices;
    this.triangles = triangles;
    this.chunks = chunksOf(vertices, triangles);
  }

  get state() {
    return this.#state;
  }

  get bytes() {
    return this.#bytes;
  }

  get place() {
    return this.#place;
  }

  get wanted() {
    return this.#wanted;
  }

  get used() {
    return this.#used;
  }

  // --- what a view needs ---

  want(pixels) {
    this.#wanted = pixels;
  }

  use(frame) {
    this.#used = frame;
  }

  // --- events ---

  #go(to, ...from) {
    if (!from.includes(this.#state))
      throw new Error(`page ${this.number}: state ${this.#state}, not ${from}`);
    this.#state = to;
  }

  request() {
    this.#go(REQUESTED, NONE);
  }

  fail() {
    this.#go(NONE, REQUESTED);
  }

  arrive(bytes) {
    this.#go(STORED, NONE, REQUESTED);
    this.#bytes = bytes;
  }

  forget() {
    if (this.#state !== RESIDENT) this.#go(NONE, STORED);
    this.#bytes = null;
  }

  decode() {
    this.#go(DECODING, STORED);
  }

  spoil() {
    this.#go(NONE, DECODING);
    this.#bytes = null;
  }

  finish() {
    this.#go(DECODED, DECODING);
  }

  dismiss() {
    this.#go(STORED, DECODED);
  }

  insert(place) {
    this.#go(RESIDENT, DECODED);
    this.#place = place;
    this.owner.resident[this.number] = 1;
    this.attempts.reset();
  }

  move(place) {
    this.#go(RESIDENT, RESIDENT);
    this.#place = place;
  }

  evict() {
    this.#go(this.#bytes ? STORED : NONE, RESIDENT);
    this.#place = null;
    this.owner.resident[this.number] = 0;
  }
}
