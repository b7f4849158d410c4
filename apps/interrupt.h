// SPDX-License-Identifier: MIT
#pragma once

namespace holdfast::apps {

/// From now on Ctrl-C asks for a clean stop (Interrupted()); a second one kills the program.
void WatchForInterrupt();

/// Thrown where interrupted work cannot just return.
struct Stopped {};

}  // namespace holdfast::apps
