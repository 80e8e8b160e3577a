// Files for Workers: what imports one has nothing of it to call.
export {};
