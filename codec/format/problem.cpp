#include "format/blob.h"

namespace meshlet {

std::string sentence(const Problem& problem) {
  std::string text = problem.text;
  const size_t number = text.find('#');
  if (number != std::string::npos) text.replace(number, 1, std::to_string(problem.number));
  if (problem.meshlet != NO_MESHLET)
    text = "meshlet " + std::to_string(problem.meshlet) + ": " + text;
  if (problem.blob != kNoBlob) text = "blob " + std::to_string(problem.blob) + ": " + text;
  return text;
}

}  // namespace meshlet
