// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <string>

namespace holdfast {

/// Records in a network's notes ("rest_pelvis") the rest pelvis of the embedded body at training
/// (kEmbeddedRestPelvis).
void NoteRestPelvis(std::map<std::string, std::string>& notes);

/// Returns a warning if holdfast.train trained a network with another rest pelvis: its positions
/// are then off by the difference. Networks of other programs are for SMPL-X. `source` is its file.
std::optional<std::string> OldPelvisWarning(const std::string& source,
                                            const std::map<std::string, std::string>& notes);

}  // namespace holdfast
