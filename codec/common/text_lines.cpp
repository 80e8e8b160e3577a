#include "common/text_lines.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace gltf_meshlet_codec {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

bool ends_line(const char* at, const char* end) { return at == end || *at == '\n' || *at == '#'; }

// Skips blanks, and line ends that a backslash escapes.
const char* skip_blanks(const char* at, const char* end) {
  for (; at != end; at++) {
    if (is_blank(*at)) continue;
    if (*at != '\\') break;
    const char* after = at + 1;
    if (after != end && *after == '\r') after++;
    if (after == end || *after != '\n') break;
    at = after;
  }
  return at;
}

const char* end_of_line(const char* at, const char* end) {
  const void* found = std::memchr(at, '\n', size_t(end - at));
  return found ? static_cast<const char*>(found) : end;
}

// Is the word at this place the keyword, in any case?
bool is_keyword(const char* at, const char* end, std::string_view keyword) {
  constexpr char kLower = 'a' ^ 'A';
  if (size_t(end - at) < keyword.size()) return false;
  for (const char c : keyword)
    if ((*at++ | kLower) != c) return false;
  return keyword.empty() || ends_line(at, end) || is_blank(*at);
}

[[noreturn]] void refuse(const char* line, const char* end) {
  constexpr ptrdiff_t kLongest = 80;
  std::string shown(line, std::min(end_of_line(line, end), line + std::min(kLongest, end - line)));
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  throw std::invalid_argument("\"" + shown + "\" is not a line of numbers");
}

// Of a number that no double holds: is it too small for one? Otherwise it is too large.
bool is_tiny(const char* at, const char* end) {
  int64_t place = 0;  // digits from the first that is not 0 to the point; below 0 behind it
  bool has_begun = false, is_behind = false;
  for (; at != end && *at != 'e' && *at != 'E'; at++) {
    is_behind |= *at == '.';
    has_begun |= '1' <= *at && *at <= '9';
    if ('0' <= *at && *at <= '9')
      place += int(has_begun && !is_behind) - int(!has_begun && is_behind);
  }
  if (at == end) return place < 0;
  if (++at != end && *at == '+') at++;
  int64_t exponent = 0;
  const bool is_far = std::from_chars(at, end, exponent).ec != std::errc();
  return is_far ? at != end && *at == '-' : exponent < -place;
}

// Reads one number; returns null if there is none. The closest double of a tiny one is 0.
template <class Number>
const char* read_number(const char* at, const char* end, std::vector<Number>& numbers) {
  if (at != end && *at == '+') at++;
  Number value;
  const auto [after, error] = std::from_chars(at, end, value);
  if (error == std::errc::result_out_of_range && std::is_floating_point_v<Number> &&
      is_tiny(at, after))
    value = 0;
  else if (error != std::errc())
    return nullptr;
  numbers.push_back(value);
  return after;
}

// Reads 1, 2 or 3 integers between slashes; the second may be left out.
const char* read_corner(const char* at, const char* end, std::vector<int32_t>& corners) {
  const size_t wanted = corners.size() + 3;
  for (at = read_number(at, end, corners); at && at != end && *at == '/';) {
    if (corners.size() == wanted) return nullptr;
    if (++at == end || *at == '/' || is_blank(*at) || *at == '\n')
      corners.push_back(0);
    else
      at = read_number(at, end, corners);
  }
  corners.resize(wanted, 0);
  return at;
}

// Reads words, each with read_word(at, end, numbers), up to the end of the line, which starts at
// `line`. Returns that end; notes how many numbers there were.
template <class Number, class ReadWord>
const char* read_words(const char* at, const char* end, const char* line,
                       std::vector<Number>& numbers, std::vector<uint32_t>& counts,
                       ReadWord read_word) {
  const size_t before = numbers.size();
  while (!ends_line(at, end)) {
    at = read_word(at, end, numbers);
    if (!at || !(ends_line(at, end) || is_blank(*at) || *at == '\\')) refuse(line, end);
    at = skip_blanks(at, end);
  }
  counts.push_back(uint32_t(numbers.size() - before));
  return at;
}

// Reads what follows a keyword in the line that starts at `line`. Returns where its end is looked
// for.
const char* read_line(const char* at, const char* end, const char* line, Words words,
                      TextLines& found) {
  const char* const after = skip_blanks(at, end);
  switch (words) {
    case Words::kNumbers:
      return read_words(after, end, line, found.numbers, found.counts, read_number<double>);
    case Words::kCorners:
      return read_words(after, end, line, found.corners, found.counts, read_corner);
    case Words::kAny: found.counts.push_back(0);
  }
  return at;
}

}  // namespace

std::vector<TextLines> scan_lines(std::string_view text, const std::vector<Keyword>& keywords) {
  std::vector<TextLines> found(keywords.size());
  const char *at = text.data(), *const end = at + text.size();
  while (at != end) {
    const char* const line = at;
    const char* const word = at = skip_blanks(line, end);  // Time stays linear: none is seen twice.
    for (size_t i = 0; i < keywords.size() && !ends_line(word, end); i++) {
      if (!is_keyword(word, end, keywords[i].word)) continue;
      found[i].offsets.push_back(uint32_t(line - text.data()));
      at = read_line(word + keywords[i].word.size(), end, line, keywords[i].words, found[i]);
      break;
    }
    at = end_of_line(at, end);
    if (at != end) at++;
  }
  return found;
}

}  // namespace gltf_meshlet_codec
