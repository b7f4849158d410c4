// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/score/clip_contact_points.h"

namespace holdfast {

/// Writes contact points and poses as named arrays (`.npz`), atomically. docs/formats.md has the
/// fields.
void WriteContactsNpz(const ClipContactPoints& contacts, const std::filesystem::path& path);

/// The same as two tables (`.csv`): contact points, and the poses of object, wrists and fingertips.
void WriteContactsCsv(const ClipContactPoints& contacts, const std::filesystem::path& path,
                      const std::filesystem::path& poses_path);

}  // namespace holdfast
