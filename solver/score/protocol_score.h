// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"
#include "solver/score/metric_values.h"

namespace holdfast {

/// Metrics of a published protocol, in table order. docs/metrics.md names their sources.
std::vector<MetricDefinition> ProtocolMetrics(ScoreProtocol protocol);

/// Values of ProtocolMetrics by key; none where undefined, such as a trial without MuJoCo or a
/// comparison without a reference. `score` has the hands that hold and their frames, and the
/// reference's errors. A grasp is a hand in a frame in which it holds; at most kProtocolGrasps of
/// them, evenly spread, are measured where a protocol needs volumes or wrenches. Stops, with
/// nothing measured, when `progress` (grasps done, grasps) returns false.
MetricValues ScoreByProtocol(const ClipScene& scene, const ClipScore& score, ScoreProtocol protocol,
                             int threads, const std::function<bool(int, int)>& progress = {});

inline constexpr int kProtocolGrasps = 50;

/// Centers (3 x n) of the cubes of edge `pitch_m`, on the grid of its multiples, that a mesh's
/// surface passes through.
Eigen::Matrix3Xd SurfaceVoxels(const TriangleMesh& mesh, double pitch_m);

/// `count` of many points that are spread evenly over a mesh's surface, each the farthest from all
/// before it (3 x count). Throws Error for a mesh without area.
Eigen::Matrix3Xd FarthestPoints(const TriangleMesh& mesh, int count);

/// A frictional contact with an object, in the frame of its wrenches: force into the object.
struct ProtocolContact {
  Eigen::Vector3d point, into;
};

/// GraspQP's measure of force closure (Zurbruegg et al. 2025): 0.5 |F x|^2, where x in [1, 21]
/// minimizes 0.5 |F x|^2 + 0.5e-4 |x|^2, and F (6 x 4 n) has the edges of cones with sine 0.2, each
/// a quarter of the unit force, and 5 times their torques about `center`. 0: the contacts balance.
double GraspQpValue(const std::vector<ProtocolContact>& contacts, const Eigen::Vector3d& center);

/// Share of 512 directions d of the space of wrenches in which some contact exerts more than 0.01:
/// max of d . (f, (p x f) / radius_m) over 8 edges of a cone of friction 0.1 and its axis
/// (video_to_data's force closure). 1: force closure by small margins.
double SupportedDirections(const std::vector<ProtocolContact>& contacts, double radius_m);

}  // namespace holdfast
