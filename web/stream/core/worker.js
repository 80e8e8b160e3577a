// A Worker of the decoder pool that also decodes pages.
import { addTask } from '../../worker.js';
import { decodePage } from './vertices.js';

addTask('decodePage', decodePage);
