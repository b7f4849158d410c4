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

/// Which joint of a source skeleton stands for which joint of SMPL-X.
struct SkeletonMap {
  std::string name;                    ///< of the naming recognized, or of the map file
  std::array<int, kNumJoints> source;  ///< source joint per SMPL-X joint, -1 for none
  /// How far behind straight up the lowest spine joint lies from the middle of the hips in a level
  /// pelvis, radians; for files whose rest pose is no pose and whose motion never stands. SMPL-X's
  /// own where a skeleton is not known to differ.
  std::optional<double> lumbar_lean;

  int NumMapped() const;
  /// Source joints that stand for nothing, by name.
  std::vector<std::string> UnusedSourceJoints(const SourceMotion& motion) const;
};

/// The bones that VRM's extension names, where the file has it. Else recognizes the naming of a
/// skeleton (SmartBody, CMU as BVH and as ASF, ACCAD, Mixamo, SMPL, ...) by which table finds most
/// of its joints. A prefix up to a last ':' ("mixamorig:"), '|' or '/', one that nearly all names
/// share up to a separator ("Character1_"), letter case, spaces, '_', '-', '.' and numbers at the
/// end of every name do not count. Throws Error listing what could not be placed, and how to give a
/// map, when no table finds pelvis, hips, knees, ankles, shoulders, elbows and wrists.
SkeletonMap RecognizeSkeleton(const SourceMotion& motion, const std::string& where);

/// Reads a map `{"source joint": "smplx joint", ...}` from a JSON file. Throws Error for anything
/// else, for names that the motion or SMPL-X lack, two sources for one joint, and missing limbs.
SkeletonMap ReadSkeletonMap(const std::filesystem::path& path, const SourceMotion& motion);

/// Names of the tables, for help texts.
std::vector<std::string> KnownSkeletons();

}  // namespace holdfast
