// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace holdfast {

/// The bytes of a pickle, read from front to back and never beyond the end: a length is compared
/// with what is left before anything is done with it. Throws Error with the position.
class PickleScanner {
 public:
  PickleScanner(std::span<const std::byte> bytes, const std::string& where)
      : bytes_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), where_(where) {}

  std::size_t Position() const { return position_; }
  std::size_t Left() const { return bytes_.size() - position_; }

  std::uint8_t Byte();
  std::string_view Take(std::uint64_t count);
  /// Up to the line's end, which is taken too.
  std::string_view Line();
  /// Unsigned little-endian number of 1 to 8 bytes.
  std::uint64_t Unsigned(int bytes);
  /// A number of so many bytes, and as many bytes as it says.
  std::string_view Counted(int bytes) { return Take(Unsigned(bytes)); }

  /// What stands at the position is not what a pickle has.
  [[noreturn]] void FailDamaged(std::string_view problem) const;
  /// A pickle that is whole, and asks for what is not given.
  [[noreturn]] void FailRefused(std::string_view problem, std::string_view remedy) const;

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  const std::string& where_;
};

}  // namespace holdfast
