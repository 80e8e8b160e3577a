#include "format/blob.h"

namespace meshlet {

void refuse(const std::string& problem) { throw Malformed(problem); }

}  // namespace meshlet
