// SPDX-License-Identifier: MIT
#include "solver/robot/hand_correspondence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/robot/robot_kinematics.h"

namespace holdfast {
namespace {

constexpr double kCapFrom = 0.7;     // fraction of an end phalanx; beyond it directions fan out
constexpr double kOutside_m = 0.12;  // distance at which the search for the surface starts
constexpr double kHit_m = 2e-5;

struct SurfaceHit {
  int link;
  Eigen::Vector3d point, normal;  // root's frame
};

// Surfaces of the links of one robot part in the straight configuration, for queries from outside.
class RobotSurface {
 public:
  RobotSurface(const RobotHand& hand, const RobotState& state, const std::vector<int>& links) {
    for (const int link : links) {
      TriangleMesh mesh = LinkMesh(hand.links[link]);
      if (mesh.NumFaces() == 0) continue;
      mesh.vertices = state.RootFromLink(link) * mesh.vertices;
      solids_.push_back({link, std::make_unique<TriangleTree>(mesh), mesh});
    }
  }

  // Returns the first surface point on the ray that starts far out along `out` from `from` and runs
  // inwards, at most `deepest` below `from`.
  std::optional<SurfaceHit> Meet(const Eigen::Vector3d& from, const Eigen::Vector3d& out,
                                 double deepest) const {
    double at = kOutside_m;
    for (int step = 0; step < 200 && at > -deepest; ++step) {
      const SurfaceHit nearest = Nearest(from + at * out);
      const double gap = (nearest.point - from - at * out).norm();
      if (gap < kHit_m) {
        SurfaceHit hit = nearest;
        if (hit.normal.dot(out) < 0.0) hit.normal = -hit.normal;
        return hit;
      }
      at -= std::max(gap, 0.5 * kHit_m);
    }
    return std::nullopt;
  }

  SurfaceHit Nearest(const Eigen::Vector3d& query) const {
    SurfaceHit nearest{-1, query, Eigen::Vector3d::UnitZ()};
    double least = std::numeric_limits<double>::infinity();
    for (const Solid& solid : solids_) {
      const TriangleTree::Hit hit = solid.tree->Closest(query);
      if (hit.squared_distance >= least) continue;
      least = hit.squared_distance;
      nearest = {solid.link, hit.point, FaceCross(solid.mesh, hit.face).normalized()};
    }
    return nearest;
  }
  bool Empty() const { return solids_.empty(); }

 private:
  struct Solid {
    int link;
    std::unique_ptr<TriangleTree> tree;
    TriangleMesh mesh;
  };
  std::vector<Solid> solids_;
};

// A phalanx of either hand: its bone and the frame of its bone (bone, pad, across).
struct Phalanx {
  Eigen::Vector3d from, to;
  Eigen::Matrix3d frame;

  Phalanx(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& pad)
      : from(a), to(b) {
    frame.col(0) = (b - a).normalized();
    frame.col(1) = (pad - pad.dot(frame.col(0)) * frame.col(0)).normalized();
    frame.col(2) = frame.col(0).cross(frame.col(1));
  }
  Eigen::Vector3d At(double share) const { return from + share * (to - from); }
};

// Frame and dimensions of a palm, used for both hands.
struct PalmFrame {
  Eigen::Matrix3d axes;  // forward, across, out
  Eigen::Vector3d knuckles;
  double width, length;
};

PalmFrame HumanPalm(const HandAxes& axes, int last_finger) {
  PalmFrame palm;
  palm.axes << axes.Forward(), axes.Across(), axes.PalmNormal();
  const auto& joints = axes.RestJoints();
  palm.knuckles.setZero();
  int fingers = 0;
  for (const int finger : {kIndex, kMiddle, kRing, kPinky}) {
    palm.knuckles += joints.col(3 * finger);
    ++fingers;
    if (finger == last_finger) break;
  }
  palm.knuckles /= fingers;
  palm.width =
      std::max(0.02, (joints.col(3 * kIndex) - joints.col(3 * last_finger)).dot(axes.Across()));
  palm.length = palm.knuckles.dot(axes.Forward());
  return palm;
}

}  // namespace

std::vector<SkinPair> PairSkins(const HandModel& human, const HandLandmarks& landmarks,
                                const HandAxes& axes, const RobotHand& robot,
                                const RobotAnatomy& anatomy) {
  const BodySurface& skin = human.Surface();
  const Eigen::Vector3d wrist = skin.RestJoints().col(WristJoint(human.HandSide()));
  const Eigen::Matrix3Xd vertices = skin.RestVertices().colwise() - wrist;
  const Eigen::Matrix3Xd normals = VertexNormals({vertices, skin.Faces()});
  RobotState state(robot);
  state.Evaluate(robot.Straight());
  std::vector<SkinPair> pairs;
  const auto add = [&](int vertex, int part, bool pad, const SurfaceHit& hit) {
    const Eigen::Isometry3d link_from_root = state.RootFromLink(hit.link).inverse();
    pairs.push_back({vertex, part, pad, hit.link, link_from_root * hit.point,
                     link_from_root.linear() * hit.normal});
  };
  for (const RobotFinger& finger : anatomy.fingers) {
    std::vector<int> links;
    for (const auto& of_phalanx : finger.links) {
      links.insert(links.end(), of_phalanx.begin(), of_phalanx.end());
    }
    const RobotSurface surface(robot, state, links);
    for (int p = 0; p < 3 && !surface.Empty(); ++p) {
      const int part = 3 * finger.human + p;
      const Phalanx mine(axes.RestJoints().col(part),
                         p == 2 ? Eigen::Vector3d(axes.RestTips().col(finger.human))
                                : Eigen::Vector3d(axes.RestJoints().col(part + 1)),
                         axes.PadDirection(part));
      const Phalanx its(finger.nodes[p], finger.nodes[p + 1], finger.pads[p]);
      const double length = (mine.to - mine.from).norm();
      for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
        if (landmarks.PartOf(static_cast<int>(v)) != part) continue;
        const Eigen::Vector3d vertex = vertices.col(v);
        const double share = std::clamp((vertex - mine.from).dot(mine.frame.col(0)) / length, 0.0,
                                        p == 2 ? kCapFrom : 1.0);
        const Eigen::Vector3d off = mine.frame.transpose() * (vertex - mine.At(share));
        if (off.norm() < 1e-6) continue;
        const auto hit = surface.Meet(its.At(share), its.frame * off.normalized(), 0.01);
        if (!hit) continue;
        const Eigen::Vector3d normal = mine.frame.transpose() * normals.col(v);
        add(static_cast<int>(v), part, normal.y() > 0.3, *hit);
      }
    }
  }
  const RobotSurface palm(robot, state, anatomy.palm_links);
  if (palm.Empty()) return pairs;
  const PalmFrame mine = HumanPalm(axes, anatomy.fingers.back().human);
  const PalmFrame its{anatomy.root_from_axes, anatomy.knuckles, anatomy.palm_width,
                      anatomy.palm_length};
  for (const int v : landmarks.Pad(kPalmPart)) {
    const Eigen::Vector3d from_knuckles = mine.axes.transpose() * (vertices.col(v) - mine.knuckles);
    const Eigen::Vector3d there(from_knuckles.x() / mine.length * its.length,
                                from_knuckles.y() / mine.width * its.width, 0.0);
    const auto hit = palm.Meet(its.knuckles + its.axes * there, its.axes.col(2), 0.06);
    if (hit && hit->normal.dot(its.axes.col(2)) > 0.3) add(v, kPalmPart, true, *hit);
  }
  return pairs;
}

TriangleMesh LinkMesh(const RobotLink& link) {
  TriangleMesh mesh;
  for (const TriangleMesh& shape : link.shapes) Append(shape, mesh);
  return mesh;
}

}  // namespace holdfast
