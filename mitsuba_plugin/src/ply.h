// Decoded geometry as a .ply file that lasts as long as it is needed.
#pragma once
#include <string>
#include <vector>

#include "part.h"

namespace meshlet_shape {

class TemporaryPly {
 public:
  // Parts one after the other; normals and texture coordinates where all parts have them. Throws
  // std::runtime_error.
  TemporaryPly(std::vector<Part> parts, bool face_normals);
  ~TemporaryPly();
  TemporaryPly(const TemporaryPly&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace meshlet_shape
