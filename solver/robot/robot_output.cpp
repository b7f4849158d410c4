// SPDX-License-Identifier: MIT
#include "solver/robot/robot_output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/parallel.h"
#include "geometry/render/camera.h"
#include "geometry/render/image.h"
#include "geometry/render/rasterizer.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// Value of a joint, followers included.
double JointValue(const RobotLink& link, const Eigen::VectorXd& q) {
  return link.offset + (link.dof < 0 ? 0.0 : link.factor * q(link.dof));
}

std::vector<int> MovingLinks(const RobotHand& hand) {
  std::vector<int> moving;
  for (int k = 0; k < hand.NumLinks(); ++k) {
    if (hand.links[k].dof >= 0) moving.push_back(k);
  }
  return moving;
}

Eigen::Isometry3d WorldFromRoot(const RobotTransferSetup& setup, const RobotPose& pose, int t) {
  return setup.demonstration.frames[t].world_from_object * pose.ObjectFromRoot();
}

std::string PoseText(const Eigen::Isometry3d& pose, const char* separator) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d p = pose.translation();
  const std::vector<double> numbers{p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
  return fmt::format("{:.7g}", fmt::join(numbers, separator));
}

// Adds a pose series as translations and continuous axis-angle vectors.
void AddPoses(const std::vector<Eigen::Isometry3d>& poses, const std::string& name,
              NpzWriter& writer) {
  std::vector<double> trans, orient;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (const Eigen::Isometry3d& pose : poses) {
    before = UnwrapAxisAngle(LogSO3(pose.linear()), before);
    const Eigen::Vector3d place = pose.translation();
    trans.insert(trans.end(), place.data(), place.data() + 3);
    orient.insert(orient.end(), before.data(), before.data() + 3);
  }
  writer.AddFloat64(name + "_trans", {poses.size(), 3}, std::move(trans));
  writer.AddFloat64(name + "_orient", {poses.size(), 3}, std::move(orient));
}

void AddContacts(const RobotTransferSetup& setup, const RobotMeasures& measures,
                 NpzWriter& writer) {
  std::vector<std::int64_t> frames, links, parts;
  std::vector<double> points, normals, distances;
  for (std::size_t t = 0; t < measures.frames.size(); ++t) {
    const Eigen::Isometry3d& world = setup.demonstration.frames[t].world_from_object;
    for (const RobotContact& contact : measures.frames[t].contacts) {
      frames.push_back(static_cast<std::int64_t>(t));
      links.push_back(contact.link);
      parts.push_back(contact.part);
      const Eigen::Vector3d point = world * contact.point;
      const Eigen::Vector3d normal = world.linear() * contact.normal;
      points.insert(points.end(), point.data(), point.data() + 3);
      normals.insert(normals.end(), normal.data(), normal.data() + 3);
      distances.push_back(contact.distance_m);
    }
  }
  const std::size_t n = frames.size();
  writer.AddInt64("contact_frame", {n}, std::move(frames));
  writer.AddInt64("contact_link", {n}, std::move(links));
  writer.AddInt64("contact_part", {n}, std::move(parts));
  writer.AddFloat64("contact_point", {n, 3}, std::move(points));
  writer.AddFloat64("contact_normal", {n, 3}, std::move(normals));
  writer.AddFloat64("contact_distance_m", {n}, std::move(distances));
}

}  // namespace

void WriteRobotMotion(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const fs::path& path) {
  const std::vector<int> moving = MovingLinks(setup.robot);
  std::vector<std::string> joints, links;
  for (const int k : moving) joints.push_back(setup.robot.links[k].joint);
  for (const RobotLink& link : setup.robot.links) links.push_back(link.name);
  std::vector<double> angles;
  std::vector<Eigen::Isometry3d> wrist, object;
  for (std::size_t t = 0; t < poses.size(); ++t) {
    for (const int k : moving) angles.push_back(JointValue(setup.robot.links[k], poses[t].q));
    wrist.push_back(WorldFromRoot(setup, poses[t], static_cast<int>(t)));
    object.push_back(setup.demonstration.frames[t].world_from_object);
  }
  NpzWriter writer;
  writer.AddText("robot", setup.robot.name);
  writer.AddText("joint_names", fmt::format("{}", fmt::join(joints, ",")));
  writer.AddText("link_names", fmt::format("{}", fmt::join(links, ",")));
  writer.AddFloat64("frame_rate", {}, {setup.demonstration.frame_rate});
  writer.AddFloat64("joint_angles", {poses.size(), moving.size()}, std::move(angles));
  AddPoses(wrist, "wrist", writer);
  AddPoses(object, "object", writer);
  AddContacts(setup, measures, writer);
  writer.Write(path);
}

namespace {

void Append(const Eigen::Vector3d& v, std::vector<float>& values) {
  for (const double value : v) values.push_back(static_cast<float>(value));
}

void AppendWxyz(const Eigen::Matrix3d& R, std::vector<float>& values) {
  const Eigen::Quaterniond q(R);
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) {
    values.push_back(static_cast<float>(value));
  }
}

// Contacts in slots, one for each part of the human hand that the robot ever touches for.
void AddContactSlots(const RobotTransferSetup& setup, const RobotMeasures& measures,
                     NpzWriter& writer) {
  constexpr double kContactGap_m = 0.005;
  std::map<int, std::string> links;  // by part
  for (const RobotFrameMeasure& frame : measures.frames) {
    for (const RobotContact& contact : frame.contacts) {
      links.emplace(contact.part, setup.robot.links[static_cast<std::size_t>(contact.link)].name);
    }
  }
  const std::size_t frames = measures.frames.size(), slots = links.size();
  std::vector<std::string> names;
  for (const auto& [part, link] : links) names.push_back(link);
  std::vector<float> on_link(3 * frames * slots), link_normal = on_link, on_object = on_link,
                                                  object_normal = on_link, active(frames);
  std::vector<std::int64_t> bodies(frames * slots);
  for (std::size_t t = 0; t < frames; ++t) {
    const Eigen::Isometry3d& world = setup.demonstration.frames[t].world_from_object;
    for (const RobotContact& contact : measures.frames[t].contacts) {
      if (contact.gap_m > kContactGap_m) continue;
      const auto slot = t * slots + static_cast<std::size_t>(
                                        std::distance(links.begin(), links.find(contact.part)));
      const SignedDistance::Result near = setup.object_distance->Query(contact.point);
      const auto set = [&](std::vector<float>& values, const Eigen::Vector3d& v) {
        for (int k = 0; k < 3; ++k) values[3 * slot + k] = static_cast<float>(v(k));
      };
      set(on_link, world * contact.point);
      set(link_normal, world.linear() * contact.normal);
      set(on_object, world * near.closest);
      set(object_normal, world.linear() * -near.gradient);  // into the object
      bodies[slot] = 1;                                     // the object's first body
      active[t] = 1.0f;
    }
  }
  writer.AddTexts("hand_contact_link_names", names);
  writer.AddFloat32("hand_link_contact_positions", {1, frames, slots, 3}, on_link);
  writer.AddFloat32("hand_link_contact_normals", {1, frames, slots, 3}, link_normal);
  writer.AddFloat32("hand_object_contact_positions", {1, frames, slots, 3}, on_object);
  writer.AddFloat32("hand_object_contact_normals", {1, frames, slots, 3}, object_normal);
  writer.AddInt64("hand_object_contact_part_ids", {1, frames, slots}, bodies);
  writer.AddFloat32("hand_contact_active", {1, frames}, active);
}

}  // namespace

void WriteMotionV1(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                   const RobotMeasures& measures, const std::string& sequence,
                   const std::string& object_mesh, const fs::path& path) {
  const std::vector<int> moving = MovingLinks(setup.robot);
  const std::size_t frames = poses.size(), links = setup.robot.links.size();
  std::vector<std::string> joints, names;
  for (const int k : moving) joints.push_back(setup.robot.links[k].joint);
  for (const RobotLink& link : setup.robot.links) names.push_back(link.name);
  std::vector<float> angles, root, root_wxyz, ee, hand, object, object_wxyz, object_turn;
  RobotState state(setup.robot);
  for (std::size_t t = 0; t < frames; ++t) {
    for (const int k : moving) {
      angles.push_back(static_cast<float>(JointValue(setup.robot.links[k], poses[t].q)));
    }
    const Eigen::Isometry3d world = WorldFromRoot(setup, poses[t], static_cast<int>(t));
    Append(world.translation(), root);
    AppendWxyz(world.linear(), root_wxyz);
    state.Evaluate(poses[t].q);
    for (std::size_t k = 0; k < links; ++k) {
      const Eigen::Isometry3d link = world * state.RootFromLink(static_cast<int>(k));
      std::vector<float>& values = k == 0 ? ee : hand;
      Append(link.translation(), values);
      AppendWxyz(link.linear(), values);
    }
    const Eigen::Isometry3d& held = setup.demonstration.frames[t].world_from_object;
    Append(held.translation(), object);
    AppendWxyz(held.linear(), object_wxyz);
    Append(LogSO3(held.linear()), object_turn);
  }
  const std::string side(SideName(setup.anatomy.side));
  const double radius = std::sqrt(setup.object.vertices.colwise().squaredNorm().maxCoeff());
  NpzWriter writer;
  writer.AddText("schema_version", "motion_v1");
  writer.AddText("sequence_id", sequence);
  writer.AddText("robot_name", setup.robot.name);
  writer.AddText("motion_kind", "single_robot");
  writer.AddText("source_dataset", "holdfast");
  writer.AddText("raw_motion_file", "");
  writer.AddFloat32("fps", {}, {static_cast<float>(setup.demonstration.frame_rate)});
  writer.AddText("coord_frame", "world");
  writer.AddTexts("robot_joint_names", joints);
  writer.AddFloat32("robot_root_position", {frames, 3}, root);
  writer.AddFloat32("robot_root_wxyz", {frames, 4}, root_wxyz);
  writer.AddFloat32("robot_joint_positions", {frames, moving.size()}, angles);
  writer.AddTexts("ee_link_names", {names.front()});
  writer.AddFloat32("ee_pose_w", {frames, 1, 7}, ee);
  writer.AddTexts("hand_sides", {side});
  writer.AddTexts("hand_frame_names", {names.begin() + 1, names.end()});
  writer.AddFloat32("hand_frames_w", {1, frames, links - 1, 7}, hand);
  writer.AddTexts("hand_finger_joint_names", joints);
  writer.AddFloat32("hand_finger_joints", {1, frames, moving.size()}, angles);
  for (const char* name : {"object_name", "safe_object_name"}) writer.AddText(name, "object");
  for (const char* name : {"object_body_names", "safe_object_body_names"}) {
    writer.AddTexts(name, {"object"});
  }
  writer.AddTexts("object_mesh_paths", {object_mesh});
  writer.AddTexts("object_urdf_paths", {});
  writer.AddFloat32("object_mesh_radius", {1}, {static_cast<float>(radius)});
  writer.AddFloat32("object_articulation", {frames}, std::vector<float>(frames));
  writer.AddFloat32("object_root_axis_angle", {frames, 3}, object_turn);
  writer.AddFloat32("object_root_position", {frames, 3}, object);
  writer.AddFloat32("object_body_position", {frames, 1, 3}, object);
  writer.AddFloat32("object_body_wxyz", {frames, 1, 4}, object_wxyz);
  AddContactSlots(setup, measures, writer);
  writer.AddText("source_kind", "");
  writer.Write(path);
}

void WriteRobotTable(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const fs::path& path) {
  const std::vector<int> moving = MovingLinks(setup.robot);
  std::string text = "frame,time_s";
  for (const char* of : {"wrist", "object"}) {
    for (const char* number : {"x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"}) {
      text += fmt::format(",{}_{}", of, number);
    }
  }
  for (const int k : moving) text += "," + setup.robot.links[k].joint;
  text += '\n';
  for (std::size_t t = 0; t < poses.size(); ++t) {
    text +=
        fmt::format("{},{:.6g},{},{}", t, static_cast<double>(t) / setup.demonstration.frame_rate,
                    PoseText(WorldFromRoot(setup, poses[t], static_cast<int>(t)), ","),
                    PoseText(setup.demonstration.frames[t].world_from_object, ","));
    for (const int k : moving) {
      text += fmt::format(",{:.7g}", JointValue(setup.robot.links[k], poses[t].q));
    }
    text += '\n';
  }
  WriteAtomically(path, text);
}

namespace {

const Eigen::Vector3d kObjectColor(0.86, 0.62, 0.28), kSkinColor(0.80, 0.66, 0.58);
const Eigen::Vector3d kPalmColor(0.42, 0.45, 0.50);
constexpr double kSeen_m = 0.13;  // visible radius around the held object's center
constexpr int kTileWidth = 420, kFilmWidth = 280;

// Distinct colors, by Finger.
Eigen::Vector3d ColorOf(const RobotAnatomy& anatomy, int link) {
  static const std::array<Eigen::Vector3d, kNumFingers> kColors = {{{0.45, 0.68, 0.52},
                                                                    {0.62, 0.66, 0.70},
                                                                    {0.72, 0.50, 0.58},
                                                                    {0.60, 0.52, 0.72},
                                                                    {0.36, 0.55, 0.75}}};
  for (const RobotFinger& finger : anatomy.fingers) {
    for (const auto& links : finger.links) {
      if (std::ranges::count(links, link) > 0) return kColors[finger.human];
    }
  }
  return kPalmColor;
}

Image Draw(const std::vector<TriangleMesh>& meshes, const std::vector<Eigen::Vector3d>& colors,
           const Camera& camera, int width) {
  std::vector<RenderItem> items;
  for (std::size_t k = 0; k < meshes.size(); ++k) items.push_back({&meshes[k], colors[k], nullptr});
  RenderOptions picture;
  picture.width = width;
  picture.height = 6 * width / 7;
  picture.ground = false;
  return Render(items, camera, picture);
}

TriangleMesh ObjectIn(const RobotTransferSetup& setup, const Eigen::Isometry3d& world) {
  return {world * setup.object.vertices, setup.object.faces};
}

// The object and the robots in frame t.
Image DrawRobots(std::span<const RobotInScene> robots, std::size_t t, const Camera& camera,
                 int width) {
  const Eigen::Isometry3d& world_from_object =
      robots.front().setup->demonstration.frames[t].world_from_object;
  std::vector<TriangleMesh> meshes{ObjectIn(*robots.front().setup, world_from_object)};
  std::vector<Eigen::Vector3d> colors{kObjectColor};
  for (const auto& [setup, poses] : robots) {
    PosedRobot posed(setup->robot);
    posed.Set((*poses)[t]);
    for (const int link : setup->solids->Links()) {
      TriangleMesh mesh = setup->solids->Of(link).mesh;
      mesh.vertices = world_from_object * posed.ObjectFromLink(link) * mesh.vertices;
      meshes.push_back(std::move(mesh));
      colors.push_back(ColorOf(setup->anatomy, link));
    }
  }
  return Draw(meshes, colors, camera, width);
}

// Forward, across and out of the palm in the world, as columns.
Eigen::Matrix3d PalmAxes(const RobotTransferSetup& setup, const HumanFrame& frame) {
  return frame.world_from_object.linear() * frame.object_from_wrist.linear() *
         (Eigen::Matrix3d() << setup.axes->Forward(), setup.axes->Across(),
          setup.axes->PalmNormal())
             .finished();
}

// Unit viewing direction that shows palm, thumb and object, averaged over the hold.
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

Image RobotFilm(std::span<const RobotInScene> robots, int columns, int rows, int threads) {
  const int cells = columns * rows;
  const RobotTransferSetup& setup = *robots.front().setup;
  const Eigen::Vector3d away = BeforeThePalm(setup);
  const double seen_m = robots.size() > 1 ? 1.8 * kSeen_m : kSeen_m;
  std::vector<Image> tiles(static_cast<std::size_t>(cells));
  std::vector<std::string> labels(tiles.size());
  ParallelFor(cells, threads, [&](int k) {
    const double last = static_cast<double>(robots.front().poses->size()) - 1.0;
    const auto t = static_cast<std::size_t>(std::lround(last * k / std::max(1, cells - 1)));
    Camera camera;
    camera.target.setZero();
    for (const RobotInScene& robot : robots) {
      const HumanFrame& frame = robot.setup->demonstration.frames[t];
      camera.target += frame.world_from_object * Eigen::Vector3d(frame.joints.col(3 * kMiddle)) /
                       static_cast<double>(robots.size());
    }
    camera.eye = camera.target + 5.6 * seen_m * away;
    camera.vertical_fov_rad = 0.42;
    tiles[k] = DrawRobots(robots, t, camera, kFilmWidth);
    labels[k] = fmt::format("{:.2f} s", static_cast<double>(t) / setup.demonstration.frame_rate);
  });
  return ContactSheet(tiles, labels, columns);
}

Image RobotSheet(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses, int columns,
                 int rows, int threads) {
  std::vector<int> held;
  for (std::size_t t = 0; t < poses.size(); ++t) {
    if (setup.demonstration.frames[t].holds) held.push_back(static_cast<int>(t));
  }
  const RobotInScene robot{&setup, &poses};
  const int cells = columns * rows / 2;
  std::vector<Image> tiles(static_cast<std::size_t>(cells * 2));
  std::vector<std::string> labels(tiles.size());
  ParallelFor(cells, threads, [&](int k) {
    const auto last = static_cast<double>(held.size() - 1);
    const int at = cells < 2 ? 0 : static_cast<int>(std::lround(last * (k / 2 * 2) / (cells - 1)));
    const int t = held[at];
    const HumanFrame& frame = setup.demonstration.frames[t];
    const Eigen::Isometry3d& world = frame.world_from_object;
    // Alternate between the palm's side and the thumb's side of the object.
    const Eigen::Matrix3d axes = PalmAxes(setup, frame);
    const Eigen::Vector3d towards = k % 2 == 0 ? Eigen::Vector3d(axes.col(2) + 0.5 * axes.col(1))
                                               : Eigen::Vector3d(axes.col(1) - 0.4 * axes.col(2));
    Camera camera;
    camera.target = 0.5 * (world * Eigen::Vector3d(frame.joints.col(3 * kMiddle)) +
                           world * Eigen::Vector3d(frame.tips.rowwise().mean()));
    camera.eye = camera.target + 5.0 * kSeen_m * towards.normalized();
    camera.up = axes.col(0);
    camera.vertical_fov_rad = 0.42;
    tiles[k * 2] =
        DrawRobots(std::span(&robot, 1), static_cast<std::size_t>(t), camera, kTileWidth);
    labels[k * 2] = fmt::format("{} {}", setup.robot.name, t);
    const TriangleMesh hand{world * frame.vertices, setup.human->Surface().Faces()};
    tiles[k * 2 + 1] =
        Draw({ObjectIn(setup, world), hand}, {kObjectColor, kSkinColor}, camera, kTileWidth);
    labels[k * 2 + 1] = fmt::format("human {}", t);
  });
  return ContactSheet(tiles, labels, columns);
}

}  // namespace holdfast
