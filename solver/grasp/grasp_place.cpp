// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_place.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Per face of the object, whether it lies on this part of the surface.
std::vector<bool> FacesOn(const TriangleMesh& object, const TriangleMesh& part) {
  const double near = 1e-6 * Extent(object).norm();
  const TriangleTree tree(part);
  std::vector<bool> on(static_cast<std::size_t>(object.NumFaces()));
  for (Eigen::Index f = 0; f < object.NumFaces(); ++f) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) middle += object.vertices.col(object.faces(k, f)) / 3.0;
    on[static_cast<std::size_t>(f)] = tree.Closest(middle).squared_distance <= near * near;
  }
  return on;
}

}  // namespace

GraspPlace::GraspPlace(const TriangleMesh& object, const Wanted& wanted)
    : tree_(object), allowed_(static_cast<std::size_t>(object.NumFaces()), true), at_(wanted.at) {
  if (wanted.region.NumFaces() > 0) allowed_ = FacesOn(object, wanted.region);
  if (wanted.avoid.NumFaces() > 0) {
    const std::vector<bool> avoided = FacesOn(object, wanted.avoid);
    for (std::size_t f = 0; f < allowed_.size(); ++f) allowed_[f] = allowed_[f] && !avoided[f];
  }
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < object.NumFaces(); ++f) {
    if (allowed_[static_cast<std::size_t>(f)]) faces.push_back(f);
  }
  if (faces.empty()) {
    throw Error(wanted.avoid.NumFaces() > 0 ? "--avoid" : "--region",
                "leaves nothing of the object's surface to hold",
                "Give a region of the object, and avoid less than all of it");
  }
  surface_ = {object.vertices, object.faces(Eigen::all, faces)};
  if (at_) {
    if (!at_->allFinite()) throw Error("--at", "is not finite", "Give three numbers, meters");
    const double off = std::sqrt(tree_.Closest(*at_).squared_distance);
    if (off > kFarthestOff_m) {
      const Eigen::Vector3d &low = tree_.Min(), &high = tree_.Max();
      throw Error("--at",
                  fmt::format("({:g}, {:g}, {:g}) is {:.1f} cm from the object's surface", at_->x(),
                              at_->y(), at_->z(), 100.0 * off),
                  fmt::format("Give a point on it in its own frame, meters: it reaches from "
                              "({:.3g}, {:.3g}, {:.3g}) to ({:.3g}, {:.3g}, {:.3g})",
                              low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
    }
    center_ = *at_;
    // Hands close on both sides of the material: its center is the reference.
    const auto through = MeasureThickness(object, tree_, *at_, wanted.span_m);
    if (through) center_ = through->start + 0.5 * through->length * through->inward;
    reach_ = kReach_m + (center_ - *at_).norm();
  } else {
    constexpr int kSamples = 2000;
    center_ = SampleSurface(surface_, kSamples, 0).rowwise().mean();
  }
}

bool GraspPlace::InRegion(const Eigen::Vector3d& point) const {
  return allowed_[static_cast<std::size_t>(tree_.Closest(point).face)];
}

bool GraspPlace::Allows(const Eigen::Vector3d& point) const {
  return (!at_ || (point - center_).norm() <= reach_) && InRegion(point);
}

namespace {

// Vertices that do not move with these hands and forearms.
std::vector<int> AwayFromHands(const BodySurface& body, std::span<const Side> sides) {
  std::vector<int> vertices;
  for (int i = 0; i < body.NumVertices(); ++i) {
    double near = 0.0;
    for (const auto& [joint, weight] : body.Weights(i)) {
      for (const Side side : sides) {
        const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
        const bool elbow = joint == WristJoint(side) - 2;
        if (finger || joint == WristJoint(side) || elbow) near += weight;
      }
    }
    if (near < 0.2) vertices.push_back(i);
  }
  return vertices;
}

}  // namespace

std::vector<Eigen::Matrix3Xd> BodyAroundWrist(const Clip& clip, const BodySurface& body, Side side,
                                              double reach_m, int num_frames, bool other_hand) {
  const Side sides[] = {side, side == Side::kRight ? Side::kLeft : Side::kRight};
  const std::vector<int> vertices = AwayFromHands(body, std::span(sides, other_hand ? 1 : 2));
  const int wrist = WristJoint(side);
  const int count = std::min(num_frames, clip.NumFrames());
  std::vector<Eigen::Matrix3Xd> frames;
  BodyState state;
  for (int k = 0; k < count; ++k) {
    const int t = count == 1 ? 0 : k * (clip.NumFrames() - 1) / (count - 1);
    Forward(body, clip.pose[t], clip.trans.col(t), state);
    Eigen::Matrix3Xd points(3, vertices.size());
    Eigen::Index kept = 0;
    for (const int i : vertices) {
      const Eigen::Vector3d from_wrist = state.vertices.col(i) - state.joints.col(wrist);
      if (from_wrist.squaredNorm() > reach_m * reach_m) continue;
      points.col(kept++) = state.world_rotation[wrist].transpose() * from_wrist;
    }
    points.conservativeResize(3, kept);
    frames.push_back(std::move(points));
  }
  return frames;
}

WristObstacles::WristObstacles(std::span<const Eigen::Matrix3Xd> in_wrist) : sets_(in_wrist) {
  for (const Eigen::Matrix3Xd& points : sets_) {
    std::vector<int> ids(static_cast<std::size_t>(points.cols()));
    std::iota(ids.begin(), ids.end(), 0);
    patches_.emplace_back(points, std::move(ids));
  }
}

double WristObstacles::ShareBlocked(const DistanceGrid& object,
                                    const Eigen::Isometry3d& wrist_from_object) const {
  constexpr double kSoftTissue = 0.002;  // meters
  if (sets_.empty()) return 0.0;
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  int blocked = 0;
  for (std::size_t k = 0; k < sets_.size(); ++k) {
    const auto distance = [&](int i) { return object.Linear(object_from_wrist * sets_[k].col(i)); };
    blocked += patches_[k].Least(distance, -kSoftTissue, -kSoftTissue) < -kSoftTissue;
  }
  return blocked / static_cast<double>(sets_.size());
}

}  // namespace holdfast
