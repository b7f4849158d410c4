// SPDX-License-Identifier: MIT
#include "solver/robot/robot_solids.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "geometry/mesh/decimate.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/parallel.h"
#include "geometry/robot/robot_kinematics.h"
#include "solver/robot/hand_correspondence.h"

namespace holdfast {
namespace {

// Recursively bisects the longest extent at whole blocks until one block is left.
void Sort(const Eigen::Matrix3Xd& points, std::vector<int>& order, int begin, int end) {
  const int blocks = (end - begin + kSampleBlock - 1) / kSampleBlock;
  if (blocks < 2) return;
  Eigen::AlignedBox3d box;
  for (int i = begin; i < end; ++i) box.extend(points.col(order[i]));
  Eigen::Index axis;
  box.sizes().maxCoeff(&axis);
  const int middle = begin + blocks / 2 * kSampleBlock;
  std::nth_element(
      order.begin() + begin, order.begin() + middle, order.begin() + end,
      [&](int a, int b) { return std::pair(points(axis, a), a) < std::pair(points(axis, b), b); });
  Sort(points, order, begin, middle);
  Sort(points, order, middle, end);
}

}  // namespace

Eigen::Matrix3Xd InBlocks(const Eigen::Matrix3Xd& points) {
  std::vector<int> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  Sort(points, order, 0, static_cast<int>(points.cols()));
  return points(Eigen::all, order);
}

Eigen::Matrix4Xd NearSamples::BallsAround(const Eigen::Matrix3Xd& points) {
  const Eigen::Index blocks = (points.cols() + kSampleBlock - 1) / kSampleBlock;
  Eigen::Matrix4Xd balls(4, blocks);
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const Eigen::Index begin = b * kSampleBlock;
    const auto block =
        points.middleCols(begin, std::min<Eigen::Index>(kSampleBlock, points.cols() - begin));
    const Eigen::Vector3d center = 0.5 * (block.rowwise().minCoeff() + block.rowwise().maxCoeff());
    balls.col(b) << center, (block.colwise() - center).colwise().norm().maxCoeff();
  }
  return balls;
}

namespace {

constexpr double kLinkSpacing_m = 0.005;
constexpr int kMaxSamples = 400;  // also for a large palm
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
  solid->samples = InBlocks(ContactSamples(solid->mesh, kLinkSpacing_m, kMaxSamples));
  solid->center = 0.5 * (solid->distance->Min() + solid->distance->Max());
  solid->radius = (solid->mesh.vertices.colwise() - solid->center).colwise().norm().maxCoeff();
  return solid;
}

}  // namespace

RobotSolids::RobotSolids(const RobotHand& hand, const RobotAnatomy& anatomy, int threads)
    : solids_(hand.links.size(), std::make_shared<LinkSolid>()) {
  std::map<int, int> finger_of, phalanx_of;  // -1: palm
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
  ParallelFor(static_cast<int>(firsts.size()), threads,
              [&](int k) { solids_[firsts[k]] = MakeSolid(hand.links[firsts[k]]); });
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

namespace {

constexpr double kPadReach_m = 0.006;     // of a pad around its paired points
constexpr double kPadSpacing_m = 0.0015;  // between pad points
constexpr int kMaxPadPoints = 250;        // per patch
constexpr double kGridError_m = 5e-4;     // of the object's interpolated distance

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

RobotPads::RobotPads(const std::vector<SkinPair>& pairs, const RobotSolids& solids,
                     bool whole_fingers) {
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
    const Eigen::Matrix3Xd places = ContactSamples(mesh, kPadSpacing_m, kMaxPadPoints);
    Eigen::Matrix<double, Eigen::Dynamic, 6> points(places.cols(), 6);
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      const TriangleTree::Hit hit = tree->Closest(places.col(i));
      points.row(i) << hit.point.transpose(), FaceCross(mesh, hit.face).normalized().transpose();
    }
    Eigen::VectorXd squared_norms = points.leftCols<3>().rowwise().squaredNorm();
    const Eigen::Matrix3Xd at = points.leftCols<3>().transpose();
    const Eigen::Vector3d center = 0.5 * (at.rowwise().minCoeff() + at.rowwise().maxCoeff());
    const double radius = (at.colwise() - center).colwise().norm().maxCoeff();
    patches_[key.first].push_back(std::make_shared<const Patch>(
        Patch{key.second, std::move(mesh), std::move(tree), std::move(points),
              std::move(squared_norms), center, radius}));
  }
  if (!whole_fingers) return;
  for (int first = 0; first < kJointsPerHand; first += 3) {
    std::vector<std::shared_ptr<const Patch>> all;
    for (int part = first; part < first + 3; ++part) {
      all.insert(all.end(), patches_[part].begin(), patches_[part].end());
    }
    for (int part = first; part < first + 3; ++part) patches_[part] = all;
  }
}

std::optional<PadPoint> RobotPads::Nearest(int part, const PosedRobot& robot,
                                           const Eigen::Vector3d& query) const {
  std::optional<PadPoint> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& of_link : patches_[part]) {
    const Patch& patch = *of_link;
    const TriangleTree::Hit hit =
        patch.tree->Closest(robot.ObjectFromLink(patch.link).inverse() * query);
    if (hit.squared_distance >= least) continue;
    least = hit.squared_distance;
    nearest = {patch.link, hit.point, FaceCross(patch.mesh, hit.face).normalized()};
  }
  return nearest;
}

std::optional<PadPoint> RobotPads::Touching(int part, const PosedRobot& robot,
                                            const DistanceGrid& object, double most_m) const {
  std::optional<PadPoint> nearest;
  double least = most_m;
  for (const auto& of_link : patches_[part]) {
    const Patch& patch = *of_link;
    const Eigen::Isometry3d& pose = robot.ObjectFromLink(patch.link);
    if (object.Linear(pose * patch.center) - patch.radius - kGridError_m > least) continue;
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

std::optional<PadPoint> RobotPads::Middle(int part, const PosedRobot& robot) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const auto& of_link : patches_[part]) {
    const Patch& patch = *of_link;
    const Eigen::Isometry3d& pose = robot.ObjectFromLink(patch.link);
    const Eigen::Vector3d mean = patch.points.leftCols<3>().colwise().mean();
    const auto points = static_cast<double>(patch.points.rows());
    sum += points * (pose * mean);
    count += points;
  }
  return count > 0.0 ? Nearest(part, robot, sum / count) : std::nullopt;
}

std::optional<PadPoint> RobotPads::BestFacing(int part, const PosedRobot& robot,
                                              const Eigen::Vector3d& point,
                                              const Eigen::Vector3d& normal, double by_place,
                                              double by_turn, double* cost) const {
  std::optional<PadPoint> best;
  *cost = std::numeric_limits<double>::infinity();
  for (const auto& of_link : patches_[part]) {
    const Patch& patch = *of_link;
    const Eigen::Isometry3d link_from_object = robot.ObjectFromLink(patch.link).inverse();
    const Eigen::Vector3d target = link_from_object * point;
    // |x - p|^2 and |m + n|^2 expanded: what depends on the pad's point is linear in (x, m).
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
