// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "solver/unknowns/vertex_term.h"

namespace holdfast {

/// Object in hand: what Penetration cannot see, since a thin wall or a blade may lie in a finger
/// without a vertex of the skin inside it. Over points o_j of the object's surface,
///
///   E_o = sum_j max(0, depth_j - give)^2,   m^2
///
/// depth_j how far o_j is below the hand's surface: the distance to the nearest of its triangles,
/// whose corners z move. One row for each point that is deeper than soft tissue gives. Points whose
/// nearest place is the open edge at the wrist do not count. Weight: lambda_o, on the sum; not part
/// of the paper's energy.
class ObjectInHand final : public SkinTerm {
 public:
  /// `samples` (3 x n) on the object's surface, its frame, meters; spacing of 3 mm leaves no room
  /// for a fingertip between them. `hand` and `samples` must outlive the term.
  ObjectInHand(const HandModel& hand, const Eigen::Matrix3Xd& samples, double give_m,
               double weight);

  /// Keeps the samples that are inside the hand or could come there, and for each the triangles
  /// that could be nearest. Does nothing while the hand has hardly moved on the object since.
  bool Watch(const Eigen::Matrix3Xd& z) override;
  void Forget() override { watched_at_.resize(3, 0); }  // what is near only saves time
  double Add(const Eigen::Matrix3Xd& z, SkinRows& rows) const override;

  std::size_t NumWatched() const { return watched_.size(); }

 private:
  struct Watched {
    int sample;
    double depth;            // where the hand was at watched_at_
    std::size_t begin, end;  // its candidates, in candidates_
  };
  struct Candidate {
    int face;
    double distance;  // from the sample, where the hand was at watched_at_
  };
  struct Near {
    int sample;
    double distance;  // of the nearest vertex, where the hand was at near_at_
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
  std::vector<Clump> clumps_;                   // vertices that lie together
  std::vector<Near> near_;                      // samples within reach
  std::vector<Watched> watched_;
  std::vector<Candidate> candidates_;      // of each sample, the nearest first
  Eigen::Matrix3Xd near_at_, watched_at_;  // z when those were chosen
};

}  // namespace holdfast
