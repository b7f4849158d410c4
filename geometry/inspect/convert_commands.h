// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/inspect/file_kind.h"

namespace holdfast {

// Commands that bring a file into the form that Holdfast reads, ready to paste into a shell. They
// take Python with numpy: what these files come with.

/// An SMPL-H, SMPL, parameter or GRAB file as an SMPL-X clip beside it.
std::string ConvertCommand(const std::filesystem::path& path, FileKind kind);

/// A clip whose world has `sign` times `axis` up, turned z-up.
std::string TurnUpCommand(const std::filesystem::path& path, int axis, int sign);

/// A clip with `trans` (and the object's) multiplied.
std::string ScaleCommand(const std::filesystem::path& path, double factor);

/// A clip with the object's rotation transposed.
std::string TransposeObjectCommand(const std::filesystem::path& path);

}  // namespace holdfast
