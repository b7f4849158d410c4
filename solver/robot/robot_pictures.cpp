// SPDX-License-Identifier: MIT
#include "solver/robot/robot_pictures.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "geometry/parallel.h"
#include "geometry/render/camera.h"
#include "geometry/render/contact_sheet.h"
#include "geometry/render/rasterizer.h"

namespace holdfast {
namespace {

const Eigen::Vector3d kObjectColour(0.86, 0.62, 0.28), kSkinColour(0.80, 0.66, 0.58);
const Eigen::Vector3d kPalmColour(0.42, 0.45, 0.50);
constexpr double kSeen_m = 0.13;  // around the middle of what is held

// Thumb to little finger, told apart.
Eigen::Vector3d ColourOf(const RobotAnatomy& anatomy, int link) {
  for (const RobotFinger& finger : anatomy.fingers) {
    for (const auto& links : finger.links) {
      if (std::ranges::count(links, link) == 0) continue;
      switch (finger.human) {
        case kThumb:
          return {0.36, 0.55, 0.75};
        case kIndex:
          return {0.45, 0.68, 0.52};
        case kMiddle:
          return {0.62, 0.66, 0.70};
        case kRing:
          return {0.60, 0.52, 0.72};
        default:
          return {0.72, 0.50, 0.58};
      }
    }
  }
  return kPalmColour;
}

// World coordinates with the camera's choice left to the picture: frames as the clip has them.
std::vector<TriangleMesh> RobotMeshes(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const Eigen::Isometry3d& world_from_object,
                                      std::vector<Eigen::Vector3d>& colours) {
  PosedRobot posed(setup.robot);
  posed.Set(pose);
  std::vector<TriangleMesh> meshes;
  for (const int link : setup.solids->Links()) {
    TriangleMesh mesh = setup.solids->Of(link).mesh;
    mesh.vertices = world_from_object * posed.ObjectFromLink(link) * mesh.vertices;
    meshes.push_back(std::move(mesh));
    colours.push_back(ColourOf(setup.anatomy, link));
  }
  return meshes;
}

Image Draw(const std::vector<TriangleMesh>& meshes, const std::vector<Eigen::Vector3d>& colours,
           const Camera& camera, const RobotPictureOptions& options) {
  std::vector<RenderItem> items;
  for (std::size_t k = 0; k < meshes.size(); ++k)
    items.push_back({&meshes[k], colours[k], nullptr});
  RenderOptions picture;
  picture.width = options.width;
  picture.height = options.height;
  picture.ground = false;
  return Render(items, camera, picture);
}

// Forward, across and out of the palm, in the world: columns.
Eigen::Matrix3d PalmAxes(const RobotTransferSetup& setup, const HumanFrame& frame) {
  return frame.world_from_object.linear() * frame.object_from_wrist.linear() *
         (Eigen::Matrix3d() << setup.axes->Forward(), setup.axes->Across(),
          setup.axes->PalmNormal())
             .finished();
}

// From where the palm, the thumb and what is held are seen, on the mean of the hold: unit.
Eigen::Vector3d BeforeThePalm(const RobotTransferSetup& setup) {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  for (const HumanFrame& frame : setup.demonstration.frames) {
    if (!frame.holds) continue;
    const Eigen::Matrix3d axes = PalmAxes(setup, frame);
    towards += axes.col(2) + 0.8 * axes.col(1);
  }
  return towards.norm() < 1e-6 ? Eigen::Vector3d(-Eigen::Vector3d::UnitY())
                               : Eigen::Vector3d(towards.normalized());
}

}  // namespace

Image RobotFilm(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const RobotPictureOptions& options) {
  const int cells = options.columns * options.rows;
  const Eigen::Vector3d away = BeforeThePalm(setup);
  std::vector<Image> tiles(static_cast<std::size_t>(cells));
  std::vector<std::string> labels(tiles.size());
  ParallelFor(cells, options.threads, [&](int k) {
    const double last = static_cast<double>(poses.size()) - 1.0;
    const auto t = static_cast<std::size_t>(std::lround(last * k / std::max(1, cells - 1)));
    const HumanFrame& frame = setup.demonstration.frames[t];
    const Eigen::Isometry3d& world = frame.world_from_object;
    Camera camera;
    camera.target = world * Eigen::Vector3d(frame.joints.col(3 * kMiddle));
    camera.eye = camera.target + 5.6 * kSeen_m * away;
    camera.vertical_fov_rad = 0.42;
    std::vector<TriangleMesh> meshes{setup.object};
    meshes.front().vertices = world * meshes.front().vertices;
    std::vector<Eigen::Vector3d> colours{kObjectColour};
    for (TriangleMesh& mesh : RobotMeshes(setup, poses[t], world, colours)) {
      meshes.push_back(std::move(mesh));
    }
    tiles[k] = Draw(meshes, colours, camera, options);
    labels[k] = fmt::format("{:.2f} s", static_cast<double>(t) / setup.demonstration.frame_rate);
  });
  return ContactSheet(tiles, labels, options.columns);
}

Image RobotSheet(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                 const RobotPictureOptions& options) {
  std::vector<int> held;
  for (std::size_t t = 0; t < poses.size(); ++t) {
    if (setup.demonstration.frames[t].holds) held.push_back(static_cast<int>(t));
  }
  const int per = options.human ? 2 : 1;
  const int cells = options.columns * options.rows / per;
  std::vector<Image> tiles(static_cast<std::size_t>(cells * per));
  std::vector<std::string> labels(tiles.size());
  ParallelFor(cells, options.threads, [&](int k) {
    const auto last = static_cast<double>(held.size() - 1);
    const int at = cells < 2 ? 0 : static_cast<int>(std::lround(last * (k / 2 * 2) / (cells - 1)));
    const int t = held[static_cast<std::size_t>(at)];
    const HumanFrame& frame = setup.demonstration.frames[t];
    const Eigen::Isometry3d& world = frame.world_from_object;
    // Towards the palm's side of what is held, and from the thumb's side, by turns.
    const Eigen::Matrix3d axes = PalmAxes(setup, frame);
    const Eigen::Vector3d towards = k % 2 == 0 ? Eigen::Vector3d(axes.col(2) + 0.5 * axes.col(1))
                                               : Eigen::Vector3d(axes.col(1) - 0.4 * axes.col(2));
    Camera camera;
    camera.target = 0.5 * (world * Eigen::Vector3d(frame.joints.col(3 * kMiddle)) +
                           world * Eigen::Vector3d(frame.tips.rowwise().mean()));
    camera.eye = camera.target + 5.0 * kSeen_m * towards.normalized();
    camera.up = axes.col(0);
    camera.vertical_fov_rad = 0.42;
    TriangleMesh object = setup.object;
    object.vertices = world * object.vertices;
    std::vector<Eigen::Vector3d> colours{kObjectColour};
    std::vector<TriangleMesh> meshes{object};
    for (TriangleMesh& mesh : RobotMeshes(setup, poses[t], world, colours)) {
      meshes.push_back(std::move(mesh));
    }
    tiles[k * per] = Draw(meshes, colours, camera, options);
    labels[k * per] = fmt::format("{} {}", setup.robot.name, t);
    if (!options.human) return;
    const TriangleMesh hand{world * frame.vertices, setup.human->Surface().Faces()};
    tiles[k * per + 1] = Draw({object, hand}, {kObjectColour, kSkinColour}, camera, options);
    labels[k * per + 1] = fmt::format("human {}", t);
  });
  return ContactSheet(tiles, labels, options.columns);
}

}  // namespace holdfast
