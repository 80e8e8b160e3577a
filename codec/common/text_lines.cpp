#include "common/text_lines.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <stdexcept>
#include <string>

namespace meshlet {
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

// Returns where the numbers of a line with this keyword start, or null.
const char* after_keyword(const char* line, const char* end, std::string_view keyword) {
  const char* word = skip_blanks(line, end);
  if (ends_line(word, end) || size_t(end - word) < keyword.size() ||
      std::memcmp(word, keyword.data(), keyword.size()) != 0)
    return nullptr;
  const char* after = word + keyword.size();
  return keyword.empty() || ends_line(after, end) || is_blank(*after) ? skip_blanks(after, end)
                                                                      : nullptr;
}

[[noreturn]] void refuse(const char* line, const char* end) {
  constexpr ptrdiff_t kLongest = 80;
  std::string shown(line, std::min(end_of_line(line, end), line + std::min(kLongest, end - line)));
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  throw std::invalid_argument("\"" + shown + "\" is not a line of numbers");
}

// Reads one number; returns null if there is none.
template <class Number>
const char* read_number(const char* at, const char* end, std::vector<double>& numbers) {
  if (at != end && *at == '+') at++;
  Number value;
  const auto [after, error] = std::from_chars(at, end, value);
  if (error != std::errc()) return nullptr;
  numbers.push_back(double(value));
  return after;
}

// Reads 1, 2 or 3 integers between slashes; the second may be left out.
const char* read_corner(const char* at, const char* end, std::vector<double>& numbers) {
  const size_t wanted = numbers.size() + 3;
  for (at = read_number<int32_t>(at, end, numbers); at && at != end && *at == '/';) {
    if (numbers.size() == wanted) return nullptr;
    if (++at == end || *at == '/' || is_blank(*at) || *at == '\n')
      numbers.push_back(0);
    else
      at = read_number<int32_t>(at, end, numbers);
  }
  numbers.resize(wanted, 0);
  return at;
}

// Reads the numbers up to the end of the line, which starts at `line`.
const char* read_numbers(const char* at, const char* end, const char* line, Words words,
                         std::vector<double>& numbers) {
  while (!ends_line(at, end)) {
    at = words == Words::kCorners ? read_corner(at, end, numbers)
                                  : read_number<double>(at, end, numbers);
    if (!at || !(ends_line(at, end) || is_blank(*at) || *at == '\\')) refuse(line, end);
    at = skip_blanks(at, end);
  }
  return at;
}

}  // namespace

TextLines scan_lines(std::string_view text, std::string_view keyword, Words words) {
  TextLines found;
  const char *at = text.data(), *const end = at + text.size();
  while (at != end) {
    const char* const line = at;
    if (const char* numbers = after_keyword(at, end, keyword)) {
      const size_t before = found.numbers.size();
      if (words != Words::kAny) at = read_numbers(numbers, end, line, words, found.numbers);
      found.counts.push_back(uint32_t(found.numbers.size() - before));
      found.offsets.push_back(uint32_t(line - text.data()));
    }
    at = end_of_line(at, end);
    if (at != end) at++;
  }
  return found;
}

}  // namespace meshlet
