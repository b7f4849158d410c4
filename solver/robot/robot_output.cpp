// SPDX-License-Identifier: MIT
#include "solver/robot/robot_output.h"

#include <fstream>
#include <iterator>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/mesh/convex_pieces.h"
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

// The scene's text, and its meshes into a folder.
class SceneWriter {
 public:
  SceneWriter(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
              const fs::path& path)
      : setup_(setup), poses_(poses), hand_(setup.robot) {
    assets_ = path;
    assets_.replace_extension();
    assets_ += "_assets";
    fs::create_directories(assets_);
    children_.resize(hand_.links.size());
    for (int k = 1; k < hand_.NumLinks(); ++k) children_[hand_.links[k].parent].push_back(k);
  }

  std::string Text(int threads) {
    AddObject(threads);
    AddLink(0, WorldFromRoot(setup_, poses_.front(), 0), 2);
    return fmt::format(
        "<mujoco model=\"{}\">\n"
        "  <compiler angle=\"radian\" meshdir=\"{}\"/>\n"
        "  <option timestep=\"0.002\"/>\n"
        "  <custom><numeric name=\"frame_rate\" data=\"{:.9g}\"/></custom>\n"
        "  <default><geom condim=\"4\" friction=\"0.8 0.005 0.0001\"/></default>\n"
        "  <asset>\n{}  </asset>\n  <worldbody>\n"
        "    <light pos=\"0 -1 3\" dir=\"0 0.3 -1\"/>\n"
        "    <geom name=\"floor\" type=\"plane\" size=\"3 3 0.1\" contype=\"0\" "
        "conaffinity=\"0\"/>\n{}  </worldbody>\n"
        "  <equality>\n{}  </equality>\n  <actuator>\n{}  </actuator>\n  <keyframe>\n{}"
        "  </keyframe>\n</mujoco>\n",
        Safe(hand_.name), assets_.filename().string(), setup_.demonstration.frame_rate, asset_,
        bodies_, equality_, actuators_, Keys());
  }

 private:
  static std::string Safe(const std::string& name) {
    std::string safe;
    for (const char c : name) {
      safe += std::string_view("<>&\"'/\\").find(c) == std::string_view::npos ? c : '_';
    }
    return safe;
  }
  std::string Asset(const TriangleMesh& mesh) {
    const std::string name = fmt::format("piece_{}", pieces_++);
    WriteMesh(mesh, assets_ / (name + ".obj"));
    asset_ += fmt::format("    <mesh name=\"{0}\" file=\"{0}.obj\"/>\n", name);
    return name;
  }
  static std::string Place(const Eigen::Isometry3d& pose) {
    const std::string numbers = PoseText(pose, " ");
    std::size_t cut = 0;
    for (int k = 0; k < 3; ++k) cut = numbers.find(' ', cut + (k > 0));
    return fmt::format("pos=\"{}\" quat=\"{}\"", numbers.substr(0, cut), numbers.substr(cut + 1));
  }

  void AddObject(int threads) {
    bodies_ += "    <body name=\"object\">\n      <freejoint/>\n";
    ConvexPieceOptions options;
    options.tolerance_m = 0.003;
    options.threads = threads;
    for (const TriangleMesh& piece : SplitIntoConvexPieces(setup_.object, options).pieces) {
      bodies_ += fmt::format(
          "      <geom type=\"mesh\" mesh=\"{}\" density=\"500\" rgba=\"0.86 0.62 0.28 1\" "
          "contype=\"1\" conaffinity=\"2\"/>\n",
          Asset(piece));
    }
    bodies_ += "    </body>\n";
  }

  void AddLink(int k, const Eigen::Isometry3d& place, int depth) {
    const RobotLink& link = hand_.links[k];
    const std::string indent(2 * static_cast<std::size_t>(depth), ' ');
    bodies_ += fmt::format("{}<body name=\"{}\" {}{}>\n", indent, Safe(link.name), Place(place),
                           k == 0 ? " mocap=\"true\"" : "");
    if (link.dof >= 0) AddJoint(link, indent);
    for (const TriangleMesh& shape : link.shapes) {
      const TriangleMesh hull = ConvexHull(shape.vertices);
      if (hull.NumFaces() == 0) continue;
      bodies_ += fmt::format(
          "{}  <geom type=\"mesh\" mesh=\"{}\" density=\"1000\" rgba=\"0.5 0.55 0.6 1\" "
          "contype=\"2\" conaffinity=\"1\"/>\n",
          indent, Asset(hull));
    }
    if (link.dof >= 0 && link.shapes.empty()) {
      bodies_ +=
          indent + "  <inertial pos=\"0 0 0\" mass=\"0.001\" diaginertia=\"1e-6 1e-6 1e-6\"/>\n";
    }
    for (const int child : children_[k]) {
      const RobotLink& next = hand_.links[child];
      Eigen::Isometry3d pose = next.parent_from_joint;
      if (next.dof < 0 && next.offset != 0.0) {
        next.kind == RobotJointKind::kSliding
            ? pose.translate(next.offset * next.axis)
            : pose.rotate(Eigen::AngleAxisd(next.offset, next.axis));
      }
      AddLink(child, pose, depth + 1);
    }
    bodies_ += indent + "</body>\n";
  }

  void AddJoint(const RobotLink& link, const std::string& indent) {
    const RobotDof& dof = hand_.dofs[link.dof];
    const auto [low, high] =
        std::minmax({link.factor * dof.low + link.offset, link.factor * dof.high + link.offset});
    bodies_ += fmt::format(
        "{}  <joint name=\"{}\" type=\"{}\" axis=\"{:.9g} {:.9g} {:.9g}\" range=\"{:.9g} {:.9g}\" "
        "limited=\"true\" damping=\"0.05\" armature=\"0.0002\"/>\n",
        indent, Safe(link.joint), link.kind == RobotJointKind::kSliding ? "slide" : "hinge",
        link.axis.x(), link.axis.y(), link.axis.z(), low, high);
    if (link.joint != dof.name) {
      equality_ +=
          fmt::format("    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:.9g} {:.9g} 0 0 0\"/>\n",
                      Safe(link.joint), Safe(dof.name), link.offset, link.factor);
      return;
    }
    actuators_ += fmt::format(
        "    <position name=\"{0}\" joint=\"{0}\" kp=\"3\" ctrllimited=\"true\" "
        "ctrlrange=\"{1:.9g} {2:.9g}\"/>\n",
        Safe(link.joint), low, high);
  }

  std::string Keys() const {
    std::string keys;
    for (std::size_t t = 0; t < poses_.size(); ++t) {
      std::string qpos = PoseText(setup_.demonstration.frames[t].world_from_object, " ");
      std::string ctrl;
      for (const int k : MovingLinks(hand_)) {
        const RobotLink& link = hand_.links[k];
        const double value = JointValue(link, poses_[t].q);
        qpos += fmt::format(" {:.7g}", value);
        if (link.joint == hand_.dofs[link.dof].name) {
          ctrl += fmt::format("{}{:.7g}", ctrl.empty() ? "" : " ", value);
        }
      }
      std::string place = Place(WorldFromRoot(setup_, poses_[t], static_cast<int>(t)));
      place.replace(0, 3, "mpos");
      place.replace(place.find(" quat"), 5, " mquat");
      keys += fmt::format(
          "    <key name=\"frame_{}\" time=\"{:.9g}\" qpos=\"{}\" ctrl=\"{}\" {}/>\n", t,
          static_cast<double>(t) / setup_.demonstration.frame_rate, qpos, ctrl, place);
    }
    return keys;
  }

  const RobotTransferSetup& setup_;
  const std::vector<RobotPose>& poses_;
  const RobotHand& hand_;
  fs::path assets_;
  std::vector<std::vector<int>> children_;
  int pieces_ = 0;
  std::string asset_, bodies_, equality_, actuators_;
};

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

void WriteRobotScene(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const fs::path& path, int threads) {
  WriteAtomically(path, SceneWriter(setup, poses, path).Text(threads));
}

}  // namespace holdfast
