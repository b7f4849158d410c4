// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

namespace holdfast {

// Commands that set a clip right, ready to paste into a shell.

/// A clip whose world has `sign` times `axis` up, turned z-up.
std::string TurnUpCommand(const std::filesystem::path& path, int axis, int sign);

/// A clip with `trans` (and the object's) multiplied.
std::string ScaleCommand(const std::filesystem::path& path, double factor);

/// A clip with the object's rotation transposed; takes Python with numpy.
std::string TransposeObjectCommand(const std::filesystem::path& path);

}  // namespace holdfast
