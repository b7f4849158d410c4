// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/body/skeleton.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Correspondence between the joints of a source skeleton and SMPL-X.
struct SkeletonMap {
  std::string name;                    ///< of the recognized naming, or of the map file
  std::array<int, kNumJoints> source;  ///< source joint per SMPL-X joint, -1 for none
  /// Backward lean of the lowest spine joint from vertically above the middle of the hips, for a
  /// level pelvis, radians. For files without a usable rest pose or standing frames. If not set,
  /// SMPL-X's own is used.
  std::optional<double> lumbar_lean;

  int NumMapped() const;
  /// Names of source joints without a counterpart.
  std::vector<std::string> UnusedSourceJoints(const SourceMotion& motion) const;
};

/// Maps a skeleton by the bones of VRM's extension if present, otherwise by its joint names
/// (SmartBody, CMU as BVH and as ASF, ACCAD, Mixamo, SMPL, ...), using the table that matches most
/// joints. Ignores a prefix up to a last ':' ("mixamorig:"), '|' or '/', a prefix common to nearly
/// all names up to a separator ("Character1_"), letter case, spaces, '_', '-', '.' and numbers at
/// the end of every name. Throws Error, listing unmatched joints and how to give a map, if no table
/// matches pelvis, hips, knees, ankles, shoulders, elbows and wrists.
SkeletonMap RecognizeSkeleton(const SourceMotion& motion, const std::string& where);

/// Reads a map `{"source joint": "smplx joint", ...}` from a JSON file. Throws Error for other
/// content, names unknown to the motion or SMPL-X, two sources for one joint, and missing limbs.
SkeletonMap ReadSkeletonMap(const std::filesystem::path& path, const SourceMotion& motion);

/// Names of the tables, for help texts.
std::vector<std::string> KnownSkeletons();

}  // namespace holdfast
