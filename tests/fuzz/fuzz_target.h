// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast::fuzz {

/// What a reader promised and did not keep. Nothing catches it in a fuzzer: that is a crash found.
class BrokenPromise : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

inline void Require(bool kept, const char* promise) {
  if (!kept) throw BrokenPromise(promise);
}

/// One input on its way through a reader. A target reads, calls Accept(), and may then check what
/// was read.
class Trial {
 public:
  explicit Trial(std::span<const std::byte> bytes);

  std::span<const std::byte> Bytes() const { return bytes_; }
  std::string_view Text() const {
    return {reinterpret_cast<const char*>(bytes_.data()), bytes_.size()};
  }

  /// The reader took the input: errors are no longer forgiven, and memory and time not counted.
  void Accept();
  /// Ends the count of memory and time. Throws BrokenPromise when it was too much memory.
  void StopCounting();

  bool Accepted() const { return accepted_; }
  double Seconds() const { return seconds_; }
  std::size_t PeakBytes() const { return peak_bytes_; }

 private:
  std::span<const std::byte> bytes_;
  double started_s_;
  std::size_t live_at_start_;
  bool stopped_ = false;
  bool accepted_ = false;
  double seconds_ = 0;
  std::size_t peak_bytes_ = 0;
};

struct FuzzTarget {
  std::string_view name;
  void (*read)(Trial&);
};

/// The targets linked into this program: one in a fuzzer, all in the replaying test.
std::vector<FuzzTarget>& Targets();

struct Registration {
  explicit Registration(FuzzTarget target) { Targets().push_back(target); }
};

struct Outcome {
  bool accepted = false;
  std::string refusal;         ///< the Error's text
  double seconds = 0;          ///< of reading
  std::size_t peak_bytes = 0;  ///< of live memory while reading, over what was live before
};

/// What reading n bytes may take at its peak: ten times as much, and 64 MB.
constexpr std::size_t AllowedBytes(std::size_t n) { return 10 * n + (std::size_t{64} << 20); }

/// Reads one input. Throws BrokenPromise when the reader takes more memory than allowed or an
/// accepted input fails a check; whatever else than holdfast::Error the reader throws goes through.
Outcome Run(const FuzzTarget& target, std::span<const std::byte> bytes);

}  // namespace holdfast::fuzz

/// HOLDFAST_FUZZ_TARGET(bvh) { ... trial ... }: what is done with one input of that target.
#define HOLDFAST_FUZZ_TARGET(name)                                                       \
  static void Read_##name(::holdfast::fuzz::Trial& trial);                               \
  static const ::holdfast::fuzz::Registration registration_##name({#name, Read_##name}); \
  static void Read_##name(::holdfast::fuzz::Trial& trial)
