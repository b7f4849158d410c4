// SPDX-License-Identifier: MIT
#include "geometry/robot/robot_hand.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/robot/reader_process.h"
#include "geometry/robot/robot_file.h"
#include "geometry/robot/robot_kinematics.h"

namespace holdfast {
namespace {

constexpr double kMinRange = 1e-4;  // radians or meters; a smaller range counts as none
constexpr double kTurn_rad = 2.0 * std::numbers::pi, kSlide_m = 1.0;  // no joint needs more

// Resolves chains of followers to the leading joint, of which this one is `factor` times the value
// plus `offset`.
const RobotJointSource& Leader(const std::map<std::string, const RobotJointSource*>& by_name,
                               const std::string& source, const RobotJointSource& joint,
                               double& factor, double& offset) {
  const RobotJointSource* at = &joint;
  factor = 1.0;
  offset = 0.0;
  for (std::size_t steps = 0; !at->follows.empty(); ++steps) {
    const auto next = by_name.find(at->follows);
    if (next == by_name.end()) {
      throw Error(source,
                  fmt::format("joint '{}' follows '{}', which is not a movable joint", at->name,
                              at->follows),
                  "Correct its mimic");
    }
    if (steps > by_name.size()) {
      throw Error(source, fmt::format("joint '{}' follows itself", joint.name),
                  "Correct its mimic");
    }
    offset += factor * at->offset;
    factor *= at->factor;
    at = next->second;
  }
  return *at;
}

void RequireSense(const std::string& source, const RobotJointSource& joint) {
  for (const double value : {joint.low, joint.high, joint.factor, joint.offset}) {
    if (std::isfinite(value)) continue;
    throw Error(source,
                fmt::format("joint '{}' has a limit or mimic that is not finite", joint.name),
                "Correct its numbers");
  }
  if (joint.low > joint.high) {
    throw Error(
        source,
        fmt::format("the limits of joint '{}' are {} to {}: the lower limit is above the upper one",
                    joint.name, joint.low, joint.high),
        "Swap them");
  }
}

// Narrows limits that mean "unlimited": their midpoint would be meaningless.
void Narrow(RobotJointKind kind, RobotJointSource& joint, std::vector<std::string>& notes) {
  const bool turns = kind == RobotJointKind::kTurning;
  const double most = turns ? kTurn_rad : kSlide_m;
  if (joint.low >= -most && joint.high <= most) return;
  const double kept = turns ? std::numbers::pi : kSlide_m;
  joint.low = std::clamp(joint.low, -kept, kept);
  joint.high = std::clamp(joint.high, -kept, kept);
  notes.push_back(
      turns ? fmt::format(
                  "joint '{}' can turn more than once: limited to half a turn in each direction",
                  joint.name)
            : fmt::format(
                  "joint '{}' can slide more than a meter: limited to a meter in each direction",
                  joint.name));
}

}  // namespace

void ResolveJoints(std::vector<RobotJointSource> joints, RobotHand& hand) {
  for (RobotJointSource& joint : joints) {
    RequireSense(hand.source, joint);
    const auto link = std::ranges::find(hand.links, joint.name, &RobotLink::joint);
    if (link != hand.links.end()) Narrow(link->kind, joint, hand.notes);
  }
  std::map<std::string, const RobotJointSource*> by_name;
  for (const RobotJointSource& joint : joints) {
    if (!by_name.emplace(joint.name, &joint).second) {
      throw Error(hand.source, fmt::format("has two joints named '{}'", joint.name),
                  "Rename one of them");
    }
  }
  std::map<std::string, int> dof_of;
  for (RobotLink& link : hand.links) {
    const auto found = by_name.find(link.joint);
    if (link.kind == RobotJointKind::kFixed || found == by_name.end()) continue;
    const RobotJointSource& joint = *found->second;
    double factor = 1.0, offset = 0.0;
    const RobotJointSource& leader = Leader(by_name, hand.source, joint, factor, offset);
    if (factor == 0.0 || leader.high - leader.low < kMinRange) {
      link.offset = std::clamp(factor * leader.low + offset, joint.low, joint.high);
      hand.notes.push_back(fmt::format("joint '{}' has no range: treated as fixed", joint.name));
      continue;
    }
    const auto [dof_found, added] = dof_of.emplace(leader.name, hand.NumDofs());
    if (added) hand.dofs.push_back({leader.name, leader.low, leader.high});
    link.dof = dof_found->second;
    link.factor = factor;
    link.offset = offset;
    RobotDof& dof = hand.dofs[link.dof];
    const double one = (joint.low - offset) / factor, other = (joint.high - offset) / factor;
    const double low = std::min(one, other), high = std::max(one, other);
    // A follower's rounded limits may leave slightly less than its leader's: not an error.
    if (low < dof.high && high > dof.low) {
      dof.low = std::max(dof.low, low);
      dof.high = std::min(dof.high, high);
    }
  }
  for (const RobotDof& dof : hand.dofs) {
    if (!(dof.high > dof.low)) {
      throw Error(hand.source,
                  fmt::format("the limits of joint '{}' are {} to {}", dof.name, dof.low, dof.high),
                  "Correct its limits");
    }
  }
}

Eigen::VectorXd RobotHand::Straight() const { return Clamped(Eigen::VectorXd::Zero(NumDofs())); }

Eigen::VectorXd RobotHand::Clamped(const Eigen::VectorXd& q) const {
  Eigen::VectorXd within = q;
  for (int k = 0; k < NumDofs(); ++k) within(k) = std::clamp(q(k), dofs[k].low, dofs[k].high);
  return within;
}

int RobotHand::FindLink(const std::string& link) const {
  const auto found = std::ranges::find(links, link, &RobotLink::name);
  return found == links.end() ? -1 : static_cast<int>(found - links.begin());
}

namespace {

namespace fs = std::filesystem;

constexpr double kLargest_m = 2.0, kSmallest_m = 0.02;
constexpr int kMaxHandLinks = 1000, kMaxDofs = 200;

void RequireFinite(const RobotHand& hand) {
  for (const RobotLink& link : hand.links) {
    const bool finite = link.parent_from_joint.matrix().allFinite() && link.axis.allFinite() &&
                        std::ranges::all_of(link.shapes, [](const TriangleMesh& shape) {
                          return shape.vertices.allFinite();
                        });
    if (!finite) {
      throw Error(hand.source, fmt::format("link '{}' has numbers that are not finite", link.name),
                  "Correct its joint's origin, axis and shapes");
    }
  }
}

void RequireHandSized(const RobotHand& hand) {
  const Eigen::Matrix3Xd vertices = MeshOfLinks(hand).vertices;
  const double size = (vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff()).maxCoeff();
  if (size <= kLargest_m && size >= kSmallest_m) return;
  throw Error(hand.source, fmt::format("spans {:.4g} m, which is not the size of a hand", size),
              size > kLargest_m
                  ? "URDF and MJCF are in meters: scale a file in millimeters by 0.001 "
                    "(mesh scale, origins), or name the file of the hand without its arm"
                  : "URDF and MJCF are in meters: check the unit of its meshes and origins");
}

// Bounds the size of the tree, which is traversed in every frame.
RobotHand Bounded(RobotHand hand) {
  const bool many = hand.NumLinks() > kMaxHandLinks;
  if (!many && hand.NumDofs() <= kMaxDofs) return hand;
  throw Error(
      hand.source,
      many ? fmt::format("has {} links; the maximum is {}", hand.NumLinks(), kMaxHandLinks)
           : fmt::format("has {} independent joints; the maximum is {}", hand.NumDofs(), kMaxDofs),
      "Give the file of the hand alone");
}

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// Library errors about a mesh, if the library survives it, name no file; ours do. MuJoCo reads out
// of bounds on an OBJ with invalid indices and may survive: `only_obj` files are read beforehand.
void RequireMeshes(const std::string& source, const RobotFile& file, bool only_obj) {
  for (const auto& [name, path] : file.files) {
    if (path.empty() || !HasMeshFormat(path)) continue;
    if (only_obj && LowerExtension(path) != ".obj") continue;
    try {
      ReadMesh(path);
    } catch (const Error& error) {
      throw Error(source,
                  fmt::format("its mesh cannot be read: {}: {}", error.Where(), error.Problem()),
                  error.Remedy());
    }
  }
}

}  // namespace

bool HasRobotFormat(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  return extension == ".urdf" || extension == ".xml" || extension == ".mjcf";
}

RobotHand ReadLinks(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) {
    throw Error(path.string(), fs::is_directory(path, ignored) ? "is a folder" : "does not exist",
                "Give the .urdf or MJCF .xml file");
  }
  if (!HasRobotFormat(path)) {
    throw Error(path.string(), "does not have the extension of a robot's file",
                "Give URDF (.urdf) or MJCF (.xml); convert xacro to URDF first");
  }
  const RobotFile file = CheckRobotFile(path);
  const bool is_urdf = LowerExtension(path) == ".urdf";
  if (!is_urdf) RequireMeshes(path.string(), file, true);
  RobotHand hand;
  try {
    hand = ReadInProcess(path, is_urdf ? "urdfdom" : "MuJoCo", [&] {
      return Bounded(is_urdf ? ReadUrdf(path, file.text) : ReadMjcf(path));
    });
  } catch (const Error&) {
    if (!is_urdf) RequireMeshes(path.string(), file, false);
    throw;
  }
  RequireFinite(hand);
  return hand;
}

RobotHand ReadRobotHand(const fs::path& path) {
  RobotHand hand = ReadLinks(path);
  if (hand.dofs.empty()) {
    throw Error(path.string(), "has no movable joint", "Give a hand with fingers");
  }
  RequireHandSized(hand);
  return hand;
}

TriangleMesh MeshOfLinks(const RobotHand& robot) {
  RobotState state(robot);
  state.Evaluate(robot.Straight());
  std::vector<TriangleMesh> shapes;
  Eigen::Index vertices = 0, faces = 0;
  for (int k = 0; k < robot.NumLinks(); ++k) {
    for (const TriangleMesh& shape : robot.links[k].shapes) {
      shapes.push_back(Transformed(shape, Eigen::Affine3d(state.RootFromLink(k).matrix())));
      vertices += shape.NumVertices();
      faces += shape.NumFaces();
    }
  }
  if (shapes.empty()) {
    throw Error(robot.source, "has no link with a shape",
                "Give its links visual or collision geometry");
  }
  TriangleMesh all;
  all.vertices.resize(3, vertices);
  all.faces.resize(3, faces);
  vertices = faces = 0;
  for (const TriangleMesh& shape : shapes) {
    all.vertices.middleCols(vertices, shape.NumVertices()) = shape.vertices;
    all.faces.middleCols(faces, shape.NumFaces()) =
        shape.faces.array() + static_cast<int>(vertices);
    vertices += shape.NumVertices();
    faces += shape.NumFaces();
  }
  return all;
}

}  // namespace holdfast
