// Reads a valid blob into a page.
#pragma once
#include "transport/page.h"

namespace meshlet {
inline namespace MESHLET_BUILD {
namespace transport {

// Fills `page` from a blob that Decoder::validate accepts.
void read_blob(const uint8_t* blob, Page& page);

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace meshlet
