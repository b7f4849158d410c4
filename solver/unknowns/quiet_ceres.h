// SPDX-License-Identifier: MIT
#pragma once

namespace holdfast {

/// For programs, once, before anything is solved: Ceres reports what it meets to stderr through
/// glog, whatever its options say, and aborts the process where one of its own checks fails. After
/// this it says nothing, and a failed check ends the program with exit code 1 and a sentence.
void QuietCeres();

}  // namespace holdfast
