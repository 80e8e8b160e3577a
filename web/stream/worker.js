// The Worker of streams, as web pages name it.
import './core/worker.js';
