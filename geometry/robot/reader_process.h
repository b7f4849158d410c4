// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <string_view>

#include "geometry/robot/robot_hand.h"

namespace holdfast {

/// Runs `read` in a child process and returns its result bit for bit. The child is limited to 20 s
/// of processor time (60 s of wall time) and to 1 GB of memory beyond this process's. If `library`
/// crashes, hangs or exhausts memory on `path`, Error is thrown; errors thrown by `read` are
/// rethrown here. The child runs only `read`, does not touch this process's threads or files, and
/// prints nothing. Thread-safe.
RobotHand ReadInProcess(const std::filesystem::path& path, std::string_view library,
                        const std::function<RobotHand()>& read);

/// Mutex held while using a library that has internal locks (MuJoCo's compiler) and while forking a
/// reader process, which would otherwise inherit those locks in the locked state.
std::mutex& LibraryLock();

}  // namespace holdfast
