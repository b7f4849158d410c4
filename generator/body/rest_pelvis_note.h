// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <string>

namespace holdfast {

/// Writes into the notes of a network that was trained where the embedded body rests its pelvis
/// (kEmbeddedRestPelvis): "rest_pelvis".
void NoteRestPelvis(std::map<std::string, std::string>& notes);

/// For people, of a network that holdfast.train made while the pelvis rested elsewhere: what it
/// knows of places is off by as much. Networks of other programs are of SMPL-X. `source`: its file.
std::optional<std::string> OldPelvisWarning(const std::string& source,
                                            const std::map<std::string, std::string>& notes);

}  // namespace holdfast
