// SPDX-License-Identifier: MIT
#include "solver/robot/robot_solids.h"

#include <algorithm>
#include <map>
#include <set>

#include "geometry/mesh/contact_samples.h"
#include "geometry/mesh/decimate.h"
#include "geometry/parallel.h"
#include "solver/robot/hand_correspondence.h"
#include "solver/robot/near_samples.h"
#include "solver/robot_hand/robot_kinematics.h"

namespace holdfast {
namespace {

constexpr double kLinkSpacing_m = 0.005;
constexpr int kMostSamples = 400;  // of a large palm, too
constexpr double kCell_m = 0.0015, kPadding_m = 0.006;

bool SameShapes(const RobotLink& a, const RobotLink& b) {
  return std::ranges::equal(a.shapes, b.shapes, [](const TriangleMesh& x, const TriangleMesh& y) {
    return x.NumVertices() == y.NumVertices() && x.NumFaces() == y.NumFaces() &&
           x.vertices == y.vertices && x.faces == y.faces;
  });
}

std::shared_ptr<const LinkSolid> MakeSolid(const RobotLink& link) {
  auto solid = std::make_shared<LinkSolid>();
  solid->mesh = LinkMesh(link);
  if (solid->mesh.NumFaces() == 0 || !(SurfaceArea(solid->mesh) > 0.0)) return solid;
  solid->distance.emplace(solid->mesh);
  solid->grid.emplace(
      *solid->distance,
      DistanceGridOptions{.cell_m = kCell_m, .padding_m = kPadding_m, .exact_within_m = 0.004});
  solid->samples = InBlocks(ContactSamples(solid->mesh, kLinkSpacing_m, kMostSamples));
  solid->centre = 0.5 * (solid->distance->Min() + solid->distance->Max());
  solid->radius = (solid->mesh.vertices.colwise() - solid->centre).colwise().norm().maxCoeff();
  return solid;
}

}  // namespace

RobotSolids::RobotSolids(const RobotHand& hand, const RobotAnatomy& anatomy, int threads)
    : solids_(hand.links.size(), std::make_shared<LinkSolid>()) {
  std::map<int, int> finger_of, phalanx_of;  // -1: the palm
  for (const int link : anatomy.palm_links) finger_of[link] = -1;
  for (const RobotFinger& finger : anatomy.fingers) {
    for (int p = 0; p < 3; ++p) {
      for (const int link : finger.links[p]) {
        finger_of[link] = finger.human;
        phalanx_of[link] = p;
      }
    }
  }
  std::vector<int> firsts, like;
  for (const auto& [link, finger] : finger_of) {
    if (hand.links[link].shapes.empty()) continue;
    links_.push_back(link);
    const auto same = std::ranges::find_if(
        firsts, [&](int first) { return SameShapes(hand.links[first], hand.links[link]); });
    like.push_back(same == firsts.end() ? link : *same);
    if (same == firsts.end()) firsts.push_back(link);
  }
  ParallelFor(static_cast<int>(firsts.size()), threads, [&](int k) {
    solids_[static_cast<std::size_t>(firsts[k])] = MakeSolid(hand.links[firsts[k]]);
  });
  for (std::size_t k = 0; k < links_.size(); ++k) solids_[links_[k]] = solids_[like[k]];
  std::erase_if(links_, [&](int link) { return Of(link).Empty(); });

  RobotState state(hand);
  state.Evaluate(hand.Straight());
  const auto meet = [&](int a, int b) {
    const Eigen::Isometry3d b_from_a = state.RootFromLink(b).inverse() * state.RootFromLink(a);
    for (const auto sample : Of(a).samples.colwise()) {
      if (Of(b).grid->Distance(b_from_a * sample) < 0.001) return true;
    }
    return false;
  };
  for (const int a : links_) {
    for (const int b : links_) {
      if (a >= b || finger_of[a] == finger_of[b]) continue;
      if ((finger_of[a] < 0 && phalanx_of[b] == 0) || (finger_of[b] < 0 && phalanx_of[a] == 0)) {
        continue;
      }
      if (!meet(a, b) && !meet(b, a)) pairs_.emplace_back(a, b);
    }
  }
}

}  // namespace holdfast
