// A Worker of the decoder pool that also decodes pages.
import { addTask } from '../worker.js';
import { decodePage } from './page.js';

addTask('decodePage', decodePage);
