// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "geometry/mesh/signed_distance.h"
#include "solver/robot/human_demonstration.h"

namespace holdfast {

/// Returns "thumb1" ... "pinky3" (phalanges, numbered from the palm) or "palm".
std::string HandPartName(int part);

/// Returns the part of a name of HandPartName, or -1.
int ParseHandPart(const std::string& name);

/// Returns the contacts of a demonstration as JSON, to be edited and read back by ReadContacts. An
/// entry has `part`, `frames` [first, last], `point` (on the object's surface, object's frame,
/// meters) and `normal` (outward). A contact that moves by more than 0.5 mm begins a new entry.
nlohmann::json ContactsJson(const HumanDemonstration& demonstration);

/// Writes ContactsJson.
void WriteContacts(const HumanDemonstration& demonstration, const std::filesystem::path& path);

/// Replaces the contacts of a demonstration, in the frames in which the hand holds, by those of a
/// file of WriteContacts. `normal` may be left out; points are moved onto the surface. Throws Error
/// for unknown parts, frames outside the clip, points farther than 2 cm from the surface, and a
/// file without a contact in the hold.
void ReadContacts(const std::filesystem::path& path, const SignedDistance& object,
                  HumanDemonstration& demonstration);

}  // namespace holdfast
