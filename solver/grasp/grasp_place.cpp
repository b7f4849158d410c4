// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_place.h"

#include <cmath>
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
    if (!at_->allFinite()) throw Error("--at", "is not finite", "Give three numbers, metres");
    const double off = std::sqrt(tree_.Closest(*at_).squared_distance);
    if (off > kFarthestOff_m) {
      const Eigen::Vector3d &low = tree_.Min(), &high = tree_.Max();
      throw Error("--at",
                  fmt::format("({:g}, {:g}, {:g}) is {:.1f} cm from the object's surface", at_->x(),
                              at_->y(), at_->z(), 100.0 * off),
                  fmt::format("Give a point on it in its own frame, metres: it reaches from "
                              "({:.3g}, {:.3g}, {:.3g}) to ({:.3g}, {:.3g}, {:.3g})",
                              low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
    }
    center_ = *at_;
    // Hands close on both sides of what is there: its middle is what they are about.
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

}  // namespace holdfast
