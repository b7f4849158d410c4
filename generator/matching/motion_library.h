// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Frame at which a captured wrist is at its reach target.
struct ReachMark {
  int frame = 0;
  Side wrist = Side::kRight;
};

/// Allowed uses of a captured clip.
struct ClipUse {
  bool walking = false;            ///< stands, walks, turns: searched by motion matching
  std::optional<ReachMark> reach;  ///< played as a whole up to the mark and beyond
};

struct LibraryClip {
  std::string name;
  bool mirrored = false;
  std::vector<BodyFrame> frames;
  std::vector<SoleBits> contacts;
  std::optional<ReachMark> reach;
  int first_row = 0;  ///< row of its first frame in the features of the library
};

/// Balls of the feet (3+3) and their velocities (3+3), pelvis velocity (3) and height (1), wrists
/// (3+3), spine lean (3), yaw rate (1).
inline constexpr int kMatchPose = 26;
/// Ground positions and headings in 1/3, 2/3 and 1 s (3 x 2+2).
inline constexpr int kMatchPath = 12;
/// Motion matching feature (Clavet 2016; Holden 2020): pose and future path of a frame in its
/// heading frame. Transitions join frames with similar features; a plan sets the path part.
using MatchRow = Eigen::Matrix<float, kMatchPose + kMatchPath, 1>;

/// Ground positions (columns 0-2) and unit headings (columns 3-5) in 1/3, 2/3 and 1 s, in the
/// current heading frame.
using FuturePath = Eigen::Matrix<double, 2, 6>;

/// Captured motions at 30 Hz with a search index over their frames. Immutable after Finish, then
/// safe to share between threads.
class MotionLibrary {
 public:
  static constexpr double kFrameRate = 30.0;

  /// `rest_joints` (3 x 55) of the body of all clips, which stands on `floor_y` at rest.
  MotionLibrary(const Eigen::Matrix3Xd& rest_joints, double floor_y);

  /// Adds a clip at 30 Hz and its mirror image. Clips shorter than 0.5 s are ignored.
  void Add(const Clip& clip, const std::string& name, const ClipUse& use);
  /// Computes the feature scales. Throws Error if there is no walking frame.
  void Finish();

  const std::vector<LibraryClip>& Clips() const { return clips_; }
  const Eigen::Matrix3Xd& RestJoints() const { return rest_joints_; }
  const SolePoints& SolesOfBody() const { return soles_; }

  struct Place {
    int clip = -1, frame = 0;
    float cost = 0.0f;
  };
  /// Returns the scaled feature of a frame with its path part replaced by `path`.
  MatchRow Query(const Place& at, const FuturePath& path) const;
  /// Returns the walking frame nearest to a query. Frames less than 1/3 s before the end of their
  /// clip are excluded.
  Place Search(const MatchRow& query) const;
  /// Squared distance of a frame's feature to a query, and of the pose parts of two frames.
  float Cost(const MatchRow& query, const Place& at) const;
  float PoseCost(const Place& a, const Place& b) const;
  /// Larger horizontal distance of the two feet after aligning the bodies, meters.
  double FootDistance(const Place& a, const Place& b) const;

 private:
  MatchRow Feature(const LibraryClip& clip, const std::vector<BodyPlacement>& placed,
                   int frame) const;
  void AddOne(LibraryClip clip, bool walking);

  Eigen::Matrix3Xd rest_joints_;
  SolePoints soles_;
  double standing_pelvis_;  // meters above the ground
  std::vector<LibraryClip> clips_;
  std::vector<MatchRow> rows_;            // all frames of all clips
  std::vector<std::uint8_t> is_walking_;  // per row: whether a search may return it
  std::vector<Place> search_places_;
  Eigen::Matrix<float, MatchRow::RowsAtCompileTime, Eigen::Dynamic> search_rows_;
  MatchRow scale_ = MatchRow::Ones();
};

}  // namespace holdfast
