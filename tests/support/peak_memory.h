// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <fstream>
#include <optional>
#include <string>

namespace holdfast::testing {

/// By how much a piece of code lifts the memory this process holds, at its peak (Linux).
class PeakMemory {
 public:
  PeakMemory() {
    std::ofstream reset("/proc/self/clear_refs");
    reset << "5";  // the peak begins anew at what is held now
    reset.close();
    works_ = static_cast<bool>(reset);
    before_ = Read("VmRSS:");
  }

  /// Bytes so far; nothing where the system does not tell.
  std::optional<std::size_t> Growth() const {
    const std::size_t peak = Read("VmHWM:");
    if (!works_ || peak == 0) return std::nullopt;
    return peak > before_ ? peak - before_ : 0;
  }

 private:
  static std::size_t Read(const std::string& key) {
    std::ifstream status("/proc/self/status");
    std::string word;
    while (status >> word) {
      std::size_t kilobytes = 0;
      if (word == key && status >> kilobytes) return kilobytes << 10;
    }
    return 0;
  }

  bool works_ = false;
  std::size_t before_ = 0;
};

}  // namespace holdfast::testing
