// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <string_view>

#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// Runs `read` in a process of its own, which has 20 s of processor time (a minute in all) and 1 GB
/// of memory besides what this one has, and returns what it made, bit for bit: `library` may crash,
/// hang or grow on `path`, and here that is an Error. Errors of `read` come through. Neither the
/// process's threads nor its files are touched; the child runs nothing but `read` and prints
/// nothing. May be called from any thread.
RobotHand ReadInProcess(const std::filesystem::path& path, std::string_view library,
                        const std::function<RobotHand()>& read);

/// Held where a library is used that has locks of its own (MuJoCo's compiler), and while the
/// process of a reader begins, which would inherit them locked.
std::mutex& LibraryLock();

}  // namespace holdfast
