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

/// The moment at which a captured wrist is at what it reaches for.
struct ReachMark {
  int frame = 0;
  Side wrist = Side::kRight;
};

/// What a captured clip may be used for.
struct ClipUse {
  bool walking = false;            ///< stands, walks, turns: found by matching
  std::optional<ReachMark> reach;  ///< played as a whole up to the mark and beyond
};

struct LibraryClip {
  std::string name;
  bool mirrored = false;
  std::vector<BodyFrame> frames;
  std::vector<SoleBits> contacts;
  std::optional<ReachMark> reach;
  int first_row = 0;  ///< of its frames in the library's features
};

/// Where a body is and is going, in its heading frame. What two frames must agree in for the motion
/// to go from one to the other, and what a plan asks for (Clavet 2016; Holden 2020).
struct MatchFeature {
  static constexpr int kPose = 26;  ///< balls of the feet (3+3) and their velocities (3+3), pelvis
                                    ///< velocity (3) and height (1), wrists (3+3), spine lean (3),
                                    ///< speed of turning (1)
  static constexpr int kPath = 12;  ///< ground positions and headings in 1/3, 2/3 and 1 s (3 x 2+2)
  static constexpr int kSize = kPose + kPath;
};
using MatchRow = Eigen::Matrix<float, MatchFeature::kSize, 1>;

/// Ground positions (columns 0-2) and unit headings (columns 3-5) in 1/3, 2/3 and 1 s, in the
/// heading frame of now.
using FuturePath = Eigen::Matrix<double, 2, 6>;

/// Captured motions at 30 Hz and the index that finds frames in them. Const once built: shared by
/// any number of threads.
class MotionLibrary {
 public:
  static constexpr double kFrameRate = 30.0;

  /// `rest_joints` (3 x 55) of the body that all clips move, standing on `floor_y` at rest.
  MotionLibrary(const Eigen::Matrix3Xd& rest_joints, double floor_y);

  /// Adds a clip of 30 Hz and its mirror image. Clips shorter than 0.5 s are left out.
  void Add(const Clip& clip, const std::string& name, const ClipUse& use);
  /// Computes the features' scales. Throws Error when no frame can be walked with.
  void Finish();

  const std::vector<LibraryClip>& Clips() const { return clips_; }
  const Eigen::Matrix3Xd& RestJoints() const { return rest_joints_; }
  const SolePoints& SolesOfBody() const { return soles_; }

  struct Place {
    int clip = -1, frame = 0;
    float cost = 0.0f;
  };
  /// The scaled pose part of a frame's feature, with a path asked for in place of its own.
  MatchRow Query(const Place& at, const FuturePath& path) const;
  /// The walking frame that is nearest to a query. Frames so near to the end of their clip that
  /// they would last less than 1/3 s are not found.
  Place Search(const MatchRow& query) const;
  /// Squared distance of a frame's feature to a query, and of the pose parts of two frames.
  float Cost(const MatchRow& query, const Place& at) const;
  float PoseCost(const Place& a, const Place& b) const;
  /// The farther of the two feet's distances along the ground, bodies laid over each other, meters.
  double FootDistance(const Place& a, const Place& b) const;

  /// Pelvis speed along the ground of every walking frame, m/s, in order.
  const std::vector<float>& WalkingSpeeds() const { return speeds_; }

 private:
  MatchRow Feature(const LibraryClip& clip, const std::vector<BodyPlacement>& placed,
                   int frame) const;
  void AddOne(LibraryClip clip, bool walking);

  Eigen::Matrix3Xd rest_joints_;
  SolePoints soles_;
  double standing_pelvis_;  // meters above the ground
  std::vector<LibraryClip> clips_;
  std::vector<MatchRow> rows_;            // all frames of all clips
  std::vector<std::uint8_t> is_walking_;  // per row: may be found by a search
  std::vector<Place> search_places_;
  Eigen::Matrix<float, MatchFeature::kSize, Eigen::Dynamic> search_rows_;
  MatchRow scale_ = MatchRow::Ones();
  std::vector<float> speeds_;
};

}  // namespace holdfast
