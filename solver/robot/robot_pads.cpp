// SPDX-License-Identifier: MIT
#include "solver/robot/robot_pads.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "geometry/mesh/contact_samples.h"

namespace holdfast {
namespace {

constexpr double kPadReach_m = 0.006;     // of a pad around its paired points
constexpr double kPadSpacing_m = 0.0015;  // of its points
constexpr int kMostPadPoints = 250;       // of a patch

bool IsOfPad(const TriangleMesh& mesh, Eigen::Index f, const std::vector<const SkinPair*>& pairs) {
  const Eigen::Vector3d normal = FaceCross(mesh, f).normalized();
  return std::ranges::any_of(pairs, [&](const SkinPair* pair) {
    if (normal.dot(pair->normal) < 0.5) return false;
    const TrianglePoint near =
        ClosestOnTriangle(pair->point, mesh.vertices.col(mesh.faces(0, f)),
                          mesh.vertices.col(mesh.faces(1, f)), mesh.vertices.col(mesh.faces(2, f)));
    return (near.point - pair->point).norm() <= kPadReach_m;
  });
}

TriangleMesh PadFaces(const TriangleMesh& mesh, const std::vector<const SkinPair*>& pairs) {
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    if (IsOfPad(mesh, f, pairs)) faces.push_back(f);
  }
  return {mesh.vertices, mesh.faces(Eigen::all, faces)};
}

}  // namespace

RobotPads::RobotPads(const std::vector<SkinPair>& pairs, const RobotSolids& solids) {
  std::map<std::pair<int, int>, std::vector<const SkinPair*>> by_part_and_link;
  for (const SkinPair& pair : pairs) {
    if (pair.pad) by_part_and_link[{pair.part, pair.link}].push_back(&pair);
  }
  for (const auto& [key, of_link] : by_part_and_link) {
    const LinkSolid& solid = solids.Of(key.second);
    if (solid.Empty()) continue;
    TriangleMesh mesh = PadFaces(solid.mesh, of_link);
    if (mesh.NumFaces() == 0 || !(SurfaceArea(mesh) > 0.0)) continue;
    auto tree = std::make_unique<TriangleTree>(mesh);
    const Eigen::Matrix3Xd places = ContactSamples(mesh, kPadSpacing_m, kMostPadPoints);
    Eigen::Matrix<double, Eigen::Dynamic, 6> points(places.cols(), 6);
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      const TriangleTree::Hit hit = tree->Closest(places.col(i));
      points.row(i) << hit.point.transpose(), FaceCross(mesh, hit.face).normalized().transpose();
    }
    Eigen::VectorXd squared_norms = points.leftCols<3>().rowwise().squaredNorm();
    patches_[static_cast<std::size_t>(key.first)].push_back({key.second, std::move(mesh),
                                                             std::move(tree), std::move(points),
                                                             std::move(squared_norms)});
  }
}

std::optional<PadPoint> RobotPads::Nearest(int part, const PosedRobot& robot,
                                           const Eigen::Vector3d& query) const {
  std::optional<PadPoint> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const Patch& patch : patches_[static_cast<std::size_t>(part)]) {
    const TriangleTree::Hit hit =
        patch.tree->Closest(robot.ObjectFromLink(patch.link).inverse() * query);
    if (hit.squared_distance >= least) continue;
    least = hit.squared_distance;
    nearest = {patch.link, hit.point, FaceCross(patch.mesh, hit.face).normalized()};
  }
  return nearest;
}

std::optional<PadPoint> RobotPads::Touching(int part, const PosedRobot& robot,
                                            const DistanceGrid& object) const {
  std::optional<PadPoint> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const Patch& patch : patches_[static_cast<std::size_t>(part)]) {
    const Eigen::Isometry3d& pose = robot.ObjectFromLink(patch.link);
    for (const auto row : patch.points.rowwise()) {
      const Eigen::Vector3d x = row.head<3>();
      const double distance = object.Linear(pose * x);
      if (distance >= least) continue;
      least = distance;
      nearest = {patch.link, x, row.tail<3>()};
    }
  }
  return nearest;
}

std::optional<PadPoint> RobotPads::BestFacing(int part, const PosedRobot& robot,
                                              const Eigen::Vector3d& point,
                                              const Eigen::Vector3d& normal, double by_place,
                                              double by_turn, double* cost) const {
  std::optional<PadPoint> best;
  *cost = std::numeric_limits<double>::infinity();
  for (const Patch& patch : patches_[static_cast<std::size_t>(part)]) {
    const Eigen::Isometry3d link_from_object = robot.ObjectFromLink(patch.link).inverse();
    const Eigen::Vector3d target = link_from_object * point;
    // |x - p|^2 and |m + n|^2 multiplied out: what depends on the pad's point is linear in (x, m).
    Eigen::Matrix<double, 6, 1> slopes;
    slopes << -2.0 * by_place * target, 2.0 * by_turn * (link_from_object.linear() * normal);
    Eigen::Index i = 0;
    const double least = (by_place * patch.squared_norms + patch.points * slopes).minCoeff(&i) +
                         by_place * target.squaredNorm() + 2.0 * by_turn;
    if (least >= *cost) continue;
    *cost = least;
    best = {patch.link, patch.points.row(i).head<3>(), patch.points.row(i).tail<3>()};
  }
  return best;
}

}  // namespace holdfast
