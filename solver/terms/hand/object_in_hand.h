// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "solver/terms/hand/hand_term.h"

namespace holdfast {

/// Object in hand: covers what Penetration misses, since a thin wall or a blade may pass through a
/// finger with no skin vertex inside it. Over points o_j of the object's surface,
///
///   E_o = sum_j max(0, depth_j - give)^2,   m^2
///
/// depth_j: how far o_j is below the hand's surface, as the distance to the nearest of its
/// triangles with corners z. One row per point deeper than soft tissue allows. Points nearest to
/// the open edge at the wrist are ignored. Weight: lambda_o, on the sum; not part of the paper's
/// energy.
class ObjectInHand final : public SkinTerm {
 public:
  /// `samples` (3 x n): points of the object's surface, object frame, meters; with 3 mm spacing, no
  /// fingertip fits between them. `hand` and `samples` must outlive the term.
  ObjectInHand(const HandModel& hand, const Eigen::Matrix3Xd& samples, double give_m,
               double weight);

  /// Keeps the samples inside or near the hand, and for each the triangles that could be nearest.
  /// Does nothing while the hand has hardly moved relative to the object since the last update.
  bool Watch(const Eigen::Matrix3Xd& z) override;
  void Forget() override { watched_at_.resize(3, 0); }  // the near samples are only a cache
  double Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const override;

  std::size_t NumWatched() const { return watched_.size(); }

 private:
  struct Watched {
    int sample;
    double depth;            // at watched_at_
    std::size_t begin, end;  // range in candidates_
  };
  struct Clump {
    std::vector<int> vertices;
    Eigen::Vector3d center;
    double radius;
  };
  class Nearest;
  void SplitVertices(std::vector<int> vertices);
  void BoundClumps(const Eigen::Matrix3Xd& z);
  double NearestVertex(const Eigen::Matrix3Xd& z, const Eigen::Vector3d& o, double within,
                       int& vertex) const;
  void FindNear(const Eigen::Matrix3Xd& z);

  const HandModel& hand_;
  const Eigen::Matrix3Xd& samples_;
  double give_m_;
  double scale_;                                // square root of the weight
  std::vector<std::vector<int>> faces_around_;  // per vertex, within two rings
  std::vector<bool> at_edge_;                   // per vertex: near the open edge
  std::vector<Clump> clumps_;                   // clusters of nearby vertices
  // Samples within reach, with the distance of the nearest vertex at near_at_.
  std::vector<std::pair<int, double>> near_;
  std::vector<Watched> watched_;
  // Per sample, distance at watched_at_ and face, nearest first.
  std::vector<std::pair<double, int>> candidates_;
  Eigen::Matrix3Xd near_at_, watched_at_;  // z at their selection
};

}  // namespace holdfast
