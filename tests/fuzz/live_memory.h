// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace holdfast::fuzz {

/// Begins to watch the peak of the process's live heap memory; returns what is live now. Counts
/// every allocation, also those of C libraries and other threads: through the sanitizer's hooks, or
/// in place of the C library's functions.
std::size_t StartPeak();

/// The largest number of bytes that were live since then.
std::size_t PeakBytesSinceStart();

}  // namespace holdfast::fuzz
