// Reads the numbers of lines of text: OBJ, and PLY and STL where they are text.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace gltf_meshlet_codec {

// What the words after a line's keyword are.
enum class Words {
  kAny,      // not read; no backslash continues them, as paths may end with one
  kNumbers,  // numbers
  kCorners,  // 1, 2 or 3 integers between slashes, as in an OBJ's faces; a word gives 3 numbers, 0
             // for one that is not there
};

struct Keyword {
  std::string_view word;  // in lower case
  Words words;
};

// The lines of a text that start with one keyword.
struct TextLines {
  std::vector<double> numbers;    // of all these lines, one after the other; if they are kNumbers
  std::vector<int32_t> corners;   // the same of kCorners
  std::vector<uint32_t> counts;   // numbers of each line
  std::vector<uint32_t> offsets;  // of each line in the text
};

// Takes the lines whose first word, in any case, is a keyword; all lines that are not blank if that
// is empty. A backslash at the end continues a line, a # ends it.
// Returns the lines of each keyword.
// Throws std::invalid_argument, with the line, for a word that is not a number.
// The text must be shorter than 2^32 bytes.
std::vector<TextLines> scan_lines(std::string_view text, const std::vector<Keyword>& keywords);

}  // namespace gltf_meshlet_codec
