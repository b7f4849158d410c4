// SPDX-License-Identifier: MIT
#include "solver/robot/robot_output.h"

#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// What a joint stands at, followers too.
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

// Series of poses as translation and continuous axis-angle.
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

}  // namespace holdfast
