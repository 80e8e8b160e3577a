#include <cstdio>
#include <cstring>

#include "format/blob.h"

namespace gltf_meshlet_codec {

void write_sentence(const Problem& problem, char* out, size_t room) {
  const auto add = [&](const char* format, auto... values) {
    const int length = std::snprintf(out, room, format, values...);
    const size_t added = length > 0 ? size_t(length) : 0;
    out += added < room ? added : room - 1;
    room -= added < room ? added : room - 1;
  };
  if (problem.blob != kNoBlob) add("blob %lu: ", static_cast<unsigned long>(problem.blob));
  if (problem.meshlet != NO_MESHLET)
    add("meshlet %lu: ", static_cast<unsigned long>(problem.meshlet));
  const char* const number = std::strchr(problem.text, '#');
  if (!number) return add("%s", problem.text);
  add("%.*s", int(number - problem.text), problem.text);
  add("%lu%s", static_cast<unsigned long>(problem.number), number + 1);
}

std::string sentence(const Problem& problem) {
  char text[kSentence];
  write_sentence(problem, text, sizeof text);
  return text;
}

}  // namespace gltf_meshlet_codec
