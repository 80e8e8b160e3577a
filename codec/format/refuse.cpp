#include "format/blob.h"

namespace meshlet {

std::string sentence(const Problem& problem) {
  std::string text = problem.text;
  const size_t number = text.find('#');
  if (number != std::string::npos) text.replace(number, 1, std::to_string(problem.number));
  if (problem.meshlet == NO_MESHLET) return text;
  return "meshlet " + std::to_string(problem.meshlet) + ": " + text;
}

void refuse(const Problem& problem) { throw Malformed(sentence(problem)); }

}  // namespace meshlet
