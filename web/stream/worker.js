// A Worker of the decoder pool that also decodes pages.
import { tasks } from '../worker.js';
import { decodePage } from './page.js';

tasks.decodePage = decodePage;
