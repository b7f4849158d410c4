// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

inline constexpr double kReachedWithin = 0.10;          ///< meters: a goal counts as reached
inline constexpr double kRestsWithin = 0.02;            ///< meters: a wrist stays
inline constexpr double kSkatingPerFrame = 0.02 / 3.0;  ///< meters per frame (2/3 cm)
inline constexpr double kAirborneAnkleOrBall = 0.12;    ///< meters above the floor

/// How one motion did on its way to one goal. Frames count from 0, the start.
struct ReachOutcome {
  double closest_m = 0.0;  ///< least distance of wrist and goal
  int closest_frame = 0;   ///< the first frame that has it
  double last_m = 0.0;     ///< distance in the last frame
  double rest_m = 0.0;     ///< greatest distance in the last half second
  int reached_frame = -1;  ///< first frame within kReachedWithin, -1 for none
  /// m/s, the wrist's way into reached_frame (out of it when that is the start); NaN for none.
  double speed_at_reach_m_s = 0.0;
  /// Share of pairs of frames in which the lowest of the ankles and balls of the feet (joints 7, 8,
  /// 10, 11) moves horizontally by more than kSkatingPerFrame.
  double skating_share = 0.0;
  double airborne_share = 0.0;          ///< frames whose lowest foot joint is above 12 cm
  double peak_pelvis_m_s = 0.0;         ///< greatest speed of the pelvis
  double mean_acceleration_m_s2 = 0.0;  ///< of the 22 joints, second differences
  /// The motion stopped being numbers; all of the above is of the frames before.
  bool diverged = false;

  bool Reached() const { return reached_frame >= 0; }
  bool Rests() const { return !diverged && rest_m <= kRestsWithin; }
  bool ReachedAtEnd() const { return !diverged && last_m <= kReachedWithin; }
};

/// `joints` (66 x F) as in RolloutTrack, floor z = 0. Throws Error for no frames and a goal that is
/// not finite.
ReachOutcome MeasureReach(const Eigen::Ref<const Eigen::MatrixXf>& joints,
                          const Eigen::Vector3d& goal, Side wrist = Side::kRight);

/// Over many motions. Shares in [0, 1], distances in meters.
struct ReachSummary {
  int count = 0;
  double success = 0.0;          ///< SR: within 10 cm in any frame
  double success_at_end = 0.0;   ///< within 10 cm in the last
  double rests = 0.0;            ///< within 2 cm in all of the last half second
  double distance_mean_m = 0.0;  ///< DTG: mean of closest_m
  double distance_median_m = 0.0;
  double skating = 0.0;   ///< mean of skating_share
  double airborne = 0.0;  ///< mean of airborne_share
  double peak_pelvis_median_m_s = 0.0;
  double acceleration_m_s2 = 0.0;   ///< mean of means
  double speed_at_reach_m_s = 0.0;  ///< mean of those that reach; NaN for none
  int diverged = 0;
};

/// Throws Error for none.
ReachSummary Summarize(std::span<const ReachOutcome> outcomes);

/// Finds the lowest vertex of a posed body, skinning only those few that can be: vertices in small
/// clusters, and for each a bound, since skinning is a convex combination,
///   z_i >= min_j (e_z . A_j x + t_j) over joints j of the cluster's weights and x in its box,
/// less the most that pose blend shapes can move it. Fingers, jaw and eyes are at rest.
/// Const and shareable.
class LowestPoint {
 public:
  /// One person's surface, all of its vertices.
  explicit LowestPoint(const BodySurface& surface);

  /// A body in one pose.
  struct Placed {
    std::array<Eigen::Matrix3d, kNumBodyJoints> rotation;          ///< A_j^R, world
    Eigen::Matrix<double, 3, kNumBodyJoints> offset;               ///< A_j^t + trans, meters
    std::array<Eigen::Matrix<double, 9, 1>, kNumBodyJoints> bend;  ///< R_j - I, row-major
    std::array<double, kNumBodyJoints> bend_norm;
  };
  void Place(const Pose<double>& pose, Placed& placed) const;

  int NumVertices() const { return static_cast<int>(rest_.cols()); }
  /// Vertex i of the surface, world, meters.
  Eigen::Vector3d Vertex(const Placed& placed, int i) const;
  /// The vertex with the least z, the first of equals. `guess` is any vertex: a good one (the last
  /// frame's) saves time and changes nothing.
  int Find(const Placed& placed, int guess = 0) const;

 private:
  struct Weight {
    int joint;
    double value;
  };
  struct Corrective {
    int joint;
    Eigen::Matrix<double, 3, 9> dirs;
  };
  struct Cluster {
    std::vector<int> vertices;
    std::vector<int> joints;          // with any weight
    Eigen::Vector3d center, half;     // box of rest vertices
    std::vector<Weight> bend_bounds;  // per joint, the largest norm of its correctives
  };
  void GatherWeights(const BodySurface& surface);
  void GatherCorrectives(const BodySurface& surface);
  void Split(std::vector<int> vertices);
  double Bound(const Placed& placed, const Cluster& cluster) const;

  BoneOffsets<double> bones_;
  Eigen::Matrix3Xd rest_joints_;
  Eigen::Matrix3Xd rest_;
  std::vector<std::vector<Weight>> weights_;          // by vertex, joints 0..21
  std::vector<std::vector<Corrective>> correctives_;  // by vertex
  std::vector<Cluster> clusters_;
};

/// FS as the paper and its code have it: share of pairs of frames in which the vertex that is
/// lowest in the first moves horizontally by more than 2/3 cm. `states` (135 x F); frames from the
/// first that is not all numbers are left out. Zero for fewer than two frames.
double SkatingOfLowestVertex(const LowestPoint& body,
                             const Eigen::Ref<const StateMatrix<float>>& states);

}  // namespace holdfast::wandr
