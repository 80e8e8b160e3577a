// The namespace of one build of the decoder. The bulk decoder is compiled for several instruction
// sets; each build has types and functions of its own, or the linker would merge their inline code.
#pragma once

#ifndef MESHLET_BUILD
#define MESHLET_BUILD baseline
#endif
