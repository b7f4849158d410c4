// SPDX-License-Identifier: MIT
#include "solver/robot_hand/read_robot.h"

#include <algorithm>
#include <cctype>
#include <system_error>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/robot_hand/reader_process.h"
#include "solver/robot_hand/robot_file.h"
#include "solver/robot_hand/robot_kinematics.h"

namespace holdfast {
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
  RobotState state(hand);
  state.Evaluate(hand.Straight());
  Eigen::AlignedBox3d box;
  for (int k = 0; k < hand.NumLinks(); ++k) {
    for (const TriangleMesh& shape : hand.links[k].shapes) {
      for (const auto vertex : shape.vertices.colwise()) box.extend(state.RootFromLink(k) * vertex);
    }
  }
  if (box.isEmpty()) {
    throw Error(hand.source, "has no link with a shape", "Give its links visual or collision");
  }
  const double size = box.sizes().maxCoeff();
  if (size <= kLargest_m && size >= kSmallest_m) return;
  throw Error(hand.source, fmt::format("spans {:.4g} m: no hand does", size),
              size > kLargest_m
                  ? "URDF and MJCF are in metres: scale a file in millimetres by 0.001 "
                    "(mesh scale, origins), or name the file of the hand without its arm"
                  : "URDF and MJCF are in metres: check the unit of its meshes and origins");
}

// Its tree is gone through in every frame.
RobotHand Bounded(RobotHand hand) {
  const bool many = hand.NumLinks() > kMaxHandLinks;
  if (!many && hand.NumDofs() <= kMaxDofs) return hand;
  throw Error(
      hand.source,
      many ? fmt::format("has {} links: no hand has more than {}", hand.NumLinks(), kMaxHandLinks)
           : fmt::format("has {} joints that move on their own: no hand has more than {}",
                         hand.NumDofs(), kMaxDofs),
      "Give the file of the hand alone");
}

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// What a library says of a mesh, if it lives to, names no file: ours does. MuJoCo reads outside its
// memory where an OBJ has wrong indices, and may live: `only_obj` files are read before it.
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

RobotHand ReadRobotHand(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) {
    throw Error(path.string(), fs::is_directory(path, ignored) ? "is a folder" : "does not exist",
                "Give the hand's .urdf or MJCF .xml file");
  }
  const std::string extension = LowerExtension(path);
  if (extension != ".urdf" && extension != ".xml" && extension != ".mjcf") {
    throw Error(path.string(), "is not a robot's file by its name",
                "Give URDF (.urdf) or MJCF (.xml); make xacro into URDF first");
  }
  const RobotFile file = CheckRobotFile(path);
  const bool is_urdf = extension == ".urdf";
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
  if (hand.dofs.empty()) {
    throw Error(path.string(), "has no joint that moves", "Give a hand with fingers");
  }
  RequireFinite(hand);
  RequireHandSized(hand);
  return hand;
}

}  // namespace holdfast
