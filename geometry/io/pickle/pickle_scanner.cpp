// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_scanner.h"

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {

std::uint8_t PickleScanner::Byte() {
  if (position_ == bytes_.size()) FailDamaged("ends too early");
  return static_cast<std::uint8_t>(bytes_[position_++]);
}

std::string_view PickleScanner::Take(std::uint64_t count) {
  if (count > Left()) {
    FailDamaged(fmt::format("announces {} bytes where {} are left", count, Left()));
  }
  const std::string_view taken = bytes_.substr(position_, count);
  position_ += count;
  return taken;
}

std::string_view PickleScanner::Line() {
  const auto end = bytes_.find('\n', position_);
  if (end == std::string_view::npos) FailDamaged("ends within a line");
  std::string_view line = bytes_.substr(position_, end - position_);
  position_ = end + 1;
  // Written as text on Windows by Python 2.
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::uint64_t PickleScanner::Unsigned(int bytes) {
  const std::string_view raw = Take(static_cast<std::uint64_t>(bytes));
  std::uint64_t value = 0;
  for (int i = bytes; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(raw[i]);
  return value;
}

void PickleScanner::FailDamaged(std::string_view problem) const {
  throw Error(where_, fmt::format("is not a whole pickle: it {} (at byte {})", problem, position_),
              "The file is damaged, cut off or of another kind: get it from its source again");
}

void PickleScanner::FailRefused(std::string_view problem, std::string_view remedy) const {
  throw Error(where_, fmt::format("{} (at byte {})", problem, position_), remedy);
}

}  // namespace holdfast
