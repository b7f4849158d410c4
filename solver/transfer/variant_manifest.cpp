// SPDX-License-Identifier: MIT
#include "solver/transfer/variant_manifest.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast {

namespace fs = std::filesystem;
using nlohmann::json;

VariantManifest ReadManifest(const fs::path& path, const json& asked) {
  const fs::path folder = path.parent_path();
  VariantManifest before;
  if (!fs::exists(path)) {
    if (fs::exists(folder) && !fs::is_empty(folder)) {
      throw Error(folder.string(), "is not a folder of variants: nothing is written there",
                  "Choose another name");
    }
    return before;
  }
  std::istringstream text(ReadFile(path));
  bool first = true;
  for (std::string line; std::getline(text, line);) {
    const json entry = json::parse(line, nullptr, false);
    if (entry.is_discarded() || !entry.is_object()) break;  // interrupted while writing
    if (first && entry != asked) {
      throw Error(folder.string(), "holds variants of another clip, options or seed",
                  "Choose another folder");
    }
    if (!first) {
      if (entry.value("variant", -1) != before.tried) break;
      ++before.tried;
      before.kept += entry.value("kept", false);
      if (!entry.value("kept", false)) ++before.refused[entry.value("why", "")];
    }
    first = false;
    before.text += line + "\n";
  }
  return before;
}

using Eigen::Isometry3d;
using Eigen::Matrix3Xd;

HoldMeasure MeasureHold(const Clip& clip, const CarryingHand& hand, const GraspCarrier& carrier,
                        const PreparedObject& object, const TransferredHold& hold, double touch_m) {
  constexpr double kNear_m = 0.03, kLittle_m = 0.0004;
  HoldMeasure measure;
  HandState state(hand.to);
  Matrix3Xd measured, skin;
  std::vector<int> near;
  double least = 0.0, deepest = 0.0;  // meters, of the last measured frame
  for (int t = hold.begin; t < hold.end; ++t) {
    const auto frame = static_cast<std::size_t>(t);
    state.SetBody(clip.pose[frame], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[frame], hold.side), false);
    const Matrix3Xd vertices = clip.object->Pose(t).inverse() * state.Vertices();
    ++measure.frames;
    double moved = measured.cols() == 0 ? 1.0 : 0.0;
    for (const int i : near) moved = std::max(moved, (vertices.col(i) - measured.col(i)).norm());
    if (moved < kLittle_m) {
      measure.touching += least + moved < touch_m;
      measure.deepest_mm = std::max(measure.deepest_mm, 1e3 * (deepest + moved));
      continue;
    }
    SkinPositions(hand.anatomy.landmarks, vertices, skin);
    const Eigen::VectorXd distance = SkinDistances(hand.anatomy.landmarks, *object.fit.distance,
                                                   Isometry3d::Identity(), skin, kNear_m);
    least = distance.minCoeff();
    deepest = std::max({0.0, -least, carrier.ObjectInHand(vertices, Isometry3d::Identity())});
    measure.touching += least < touch_m;
    measure.deepest_mm = std::max(measure.deepest_mm, 1e3 * deepest);
    measured = vertices;
    near.clear();
    for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
      if (distance(i) < kNear_m) near.push_back(static_cast<int>(i));
    }
  }
  return measure;
}

double DepthInBody(const Clip& clip, const BodySurface& skin, const OwnBody& obstacle,
                   const PreparedObject& object) {
  constexpr int kFrames = 10;
  double deepest = 0.0;
  BodyState state;
  for (int k = 0; k < std::min(kFrames, clip.NumFrames()); ++k) {
    const int t = static_cast<int>((clip.NumFrames() - 1.0) * k / (kFrames - 1));
    if (clip.holding_hand[static_cast<std::size_t>(t)] == 0) continue;
    Forward(skin, clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t), state);
    const Matrix3Xd points = clip.object->Pose(t) * object.fit.vertices;
    const OwnBody::Posed posed(obstacle, state.vertices, points.rowwise().minCoeff(),
                               points.rowwise().maxCoeff(), 0.03);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (const auto touch = posed.Query(points.col(i))) deepest = std::max(deepest, touch->depth);
    }
  }
  return deepest;
}

}  // namespace holdfast
