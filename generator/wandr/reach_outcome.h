// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

inline constexpr double kReachedWithin = 0.10;  ///< meters: a goal counts as reached

/// Result of one motion towards one goal. Frames count from 0, the start.
struct ReachOutcome {
  double closest_m = 0.0;  ///< minimum distance between wrist and goal
  int closest_frame = 0;   ///< first frame with that distance
  double last_m = 0.0;     ///< distance in the last frame
  double rest_m = 0.0;     ///< maximum distance in the last half second
  int reached_frame = -1;  ///< first frame within kReachedWithin, -1 for none
  /// Fraction of frame pairs in which the lowest of the ankles and balls of the feet (joints 7, 8,
  /// 10, 11) moves horizontally by more than 2/3 cm.
  double skating_share = 0.0;
  double airborne_share = 0.0;          ///< frames with the lowest foot joint above 12 cm
  double peak_pelvis_m_s = 0.0;         ///< maximum speed of the pelvis
  double mean_acceleration_m_s2 = 0.0;  ///< over the 22 joints, second differences
  /// The motion became non-finite; all values above are for the frames before.
  bool diverged = false;

  bool Reached() const { return reached_frame >= 0; }
  /// Whether the wrist stays within 2 cm of the goal in the last half second.
  bool Rests() const { return !diverged && rest_m <= 0.02; }
};

/// `joints` (66 x F) as in RolloutTrack, floor z = 0. Throws Error if there are no frames or the
/// goal is not finite.
ReachOutcome MeasureReach(const Eigen::Ref<const Eigen::MatrixXf>& joints,
                          const Eigen::Vector3d& goal, Side wrist = Side::kRight);

/// Summary of many motions. Fractions in [0, 1], distances in meters.
struct ReachSummary {
  double success = 0.0;          ///< SR: within 10 cm in any frame
  double distance_mean_m = 0.0;  ///< DTG: mean of closest_m
  double distance_median_m = 0.0;
  double skating = 0.0;            ///< mean of skating_share
  double airborne = 0.0;           ///< mean of airborne_share
  double acceleration_m_s2 = 0.0;  ///< mean of mean_acceleration_m_s2
};

/// Throws Error if there are no outcomes.
ReachSummary Summarize(std::span<const ReachOutcome> outcomes);

/// Finds the lowest vertex of a posed body and skins only the few candidates. Vertices are grouped
/// in small clusters. Since skinning is a convex combination, each cluster has the bound
///   z_i >= min_j (e_z . A_j x + t_j) over joints j of the cluster's weights and x in its box,
/// minus the maximum displacement by pose blend shapes. Fingers, jaw and eyes are at rest.
/// Immutable and safe to share between threads.
class LowestPoint {
 public:
  /// Constructs from all vertices of one person's surface.
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
  /// Returns the vertex with minimum z, the first of equals. `guess` is any vertex; a good guess
  /// (that of the last frame) saves time and does not change the result.
  int Find(const Placed& placed, int guess = 0) const;

 private:
  using Weights = std::vector<std::pair<int, double>>;  // by joint
  struct Corrective {
    int joint;
    Eigen::Matrix<double, 3, 9> dirs;
  };
  struct Cluster {
    std::vector<int> vertices;
    std::vector<int> joints;       // with any weight
    Eigen::Vector3d center, half;  // bounding box of the rest vertices
    Weights bend_bounds;           // maximum norm of the correctives
  };
  void Split(std::vector<int> vertices);
  double Bound(const Placed& placed, const Cluster& cluster) const;

  BoneOffsets<double> bones_;
  Eigen::Matrix3Xd rest_joints_;
  Eigen::Matrix3Xd rest_;
  std::vector<Weights> weights_;                      // by vertex, joints 0..21
  std::vector<std::vector<Corrective>> correctives_;  // by vertex
  std::vector<Cluster> clusters_;
};

/// FS as in the paper and its code: fraction of frame pairs in which the vertex that is lowest in
/// the first frame moves horizontally by more than 2/3 cm. `states` (135 x F); frames from the
/// first non-finite one on are ignored. Zero for fewer than two frames.
double SkatingOfLowestVertex(const LowestPoint& body,
                             const Eigen::Ref<const StateMatrix<float>>& states);

}  // namespace holdfast::wandr
