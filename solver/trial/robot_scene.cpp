// SPDX-License-Identifier: MIT
#include "solver/trial/robot_scene.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/convex_hull.h"
#include "solver/robot/robot_measures.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// Actuation of a type of joint: as fingers in a trial, or as gripper jaws.
struct Drive {
  const char* type;
  double stiffness, most, damping, inertia;  // N m and kg m^2 per radian, or N and kg per meter
};
constexpr Drive kTurning = {"hinge", 3.0, 1.5, 0.05, 2e-4};
constexpr Drive kSliding = {"slide", 1000.0, 40.0, 10.0, 0.02};

const Drive& DriveOf(const RobotLink& link) {
  return link.kind == RobotJointKind::kSliding ? kSliding : kTurning;
}

double JointValue(const RobotLink& link, const Eigen::VectorXd& q) {
  return link.offset + (link.dof < 0 ? 0.0 : link.factor * q(link.dof));
}

// The hand's own joints, as links: without those of an arm, and without the palm's own joint.
std::set<int> HandJoints(const RobotTransferSetup& setup) {
  const std::vector<int>& palm = setup.anatomy.palm_links;
  std::set<int> own;
  for (const int link : palm) {
    if (std::ranges::count(palm, setup.robot.links[link].parent) > 0) own.insert(link);
  }
  for (const RobotFinger& finger : setup.anatomy.fingers) {
    for (const auto& phalanx : finger.links) own.insert(phalanx.begin(), phalanx.end());
  }
  std::erase_if(own, [&](int link) { return setup.robot.links[link].dof < 0; });
  return own;
}

struct Attitude {
  Eigen::Vector3d place;
  Eigen::Quaterniond turn;

  // `before`: of the two equivalent quaternions, the nearer one is used.
  explicit Attitude(const Eigen::Isometry3d& pose, const Attitude* before = nullptr)
      : place(pose.translation()), turn(pose.linear()) {
    if (before != nullptr && turn.dot(before->turn) < 0.0) turn.coeffs() *= -1.0;
  }
  std::string Place() const {
    return fmt::format("{:.7g} {:.7g} {:.7g}", place.x(), place.y(), place.z());
  }
  std::string Turn() const {
    return fmt::format("{:.9g} {:.9g} {:.9g} {:.9g}", turn.w(), turn.x(), turn.y(), turn.z());
  }
};

// Squeeze of a robot hand on the object: contacts where its links are closer than
// `protocol.touch_m` (nearest point of each), with forces from BalancePresses. `link` is the
// robot's link index; points and forces are in its root's frame.
std::vector<GripContact> GripOfRobot(const RobotTransferSetup& setup, const RobotPose& pose,
                                     const TrialSolid& solid, const TrialProtocol& protocol) {
  PosedRobot posed(setup.robot);
  posed.Set(pose);
  std::vector<GripContact> contacts = TouchesOfRobot(setup, posed, protocol.touch_m);
  BalancePresses(pose.ObjectFromRoot().inverse() * solid.mass.center, solid.radius_m,
                 protocol.scene.friction,
                 std::max(protocol.least_grip_N,
                          protocol.grip_weights * solid.mass.mass_kg * protocol.gravity_m_s2),
                 contacts);
  return contacts;
}

// Joint torques for these presses, one per degree of freedom: N m, or N for sliding joints.
Eigen::VectorXd GripTorques(const RobotHand& robot, const Eigen::VectorXd& q,
                            const std::vector<GripContact>& contacts) {
  RobotState state(robot);
  state.Evaluate(q);
  Eigen::VectorXd presses(3 * std::ssize(contacts));
  for (Eigen::Index c = 0; c < std::ssize(contacts); ++c) {
    presses.segment<3>(3 * c) = contacts[static_cast<std::size_t>(c)].press;
  }
  return ContactSlopes(state, contacts).transpose() * presses;
}

// Builds the scene's text and writes its meshes to a folder.
class SceneWriter {
 public:
  SceneWriter(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
              const fs::path& path, int threads)
      : setup_(setup), poses_(poses), hand_(setup.robot), own_(HandJoints(setup)) {
    protocol_.threads = threads;
    solid_ = MakeTrialSolid(setup.object, *setup.object_distance, protocol_);
    assets_ = MjcfAssets(path);
    fs::create_directories(assets_);
    children_.resize(hand_.links.size());
    for (int k = 1; k < hand_.NumLinks(); ++k) children_[hand_.links[k].parent].push_back(k);
  }

  std::string Text() {
    AddObject();
    const Attitude first(WorldFromRoot(0));
    const std::string root = Safe(hand_.links[0].name);
    bodies_ +=
        fmt::format("    <body name=\"wrist_target\" mocap=\"true\" pos=\"{}\" quat=\"{}\"/>\n",
                    first.Place(), first.Turn());
    AddLink(0, WorldFromRoot(0), 2);
    return fmt::format(
        "<mujoco model=\"{}\">\n"
        "  <compiler angle=\"radian\" meshdir=\"{}\"/>\n"
        "  <option timestep=\"{:.9g}\" cone=\"elliptic\" impratio=\"10\" "
        "noslip_iterations=\"3\"/>\n"
        "  <custom><numeric name=\"frame_rate\" data=\"{:.9g}\"/></custom>\n"
        "  <default><geom condim=\"4\" friction=\"{:.9g} {:.9g} 0.0001\" solref=\"0.005 1\"/>"
        "</default>\n"
        "  <asset>\n{}  </asset>\n  <worldbody>\n"
        "    <light pos=\"0 -1 3\" dir=\"0 0.3 -1\"/>\n"
        "    <geom name=\"floor\" type=\"plane\" size=\"3 3 0.1\" contype=\"0\" "
        "conaffinity=\"0\"/>\n{}  </worldbody>\n"
        "  <equality>\n    <weld body1=\"wrist_target\" body2=\"{}\" solref=\"0.005 1\" "
        "solimp=\"0.99 0.999 0.001\"/>\n{}  </equality>\n  <actuator>\n{}  </actuator>\n"
        "  <keyframe>\n{}  </keyframe>\n</mujoco>\n",
        Safe(hand_.name), assets_.filename().string(), protocol_.scene.step_s,
        setup_.demonstration.frame_rate, protocol_.scene.friction, protocol_.scene.torsion_m,
        asset_, bodies_, root, equality_, actuators_, Keys());
  }

 private:
  static std::string Safe(const std::string& name) {
    std::string safe;
    for (const char c : name) {
      safe += std::string_view("<>&\"'/\\").find(c) == std::string_view::npos ? c : '_';
    }
    return safe;
  }
  Eigen::Isometry3d WorldFromRoot(std::size_t t) const {
    return setup_.demonstration.frames[t].world_from_object * poses_[t].ObjectFromRoot();
  }
  bool Moves(int link) const { return own_.contains(link); }
  // Whether it has its own joint and actuator.
  bool Leads(int link) const {
    return hand_.links[link].joint == hand_.dofs[hand_.links[link].dof].name;
  }
  std::string Asset(const TriangleMesh& mesh) {
    const std::string name = fmt::format("piece_{}", pieces_++);
    WriteMesh(mesh, assets_ / (name + ".obj"));
    asset_ += fmt::format("    <mesh name=\"{0}\" file=\"{0}.obj\"/>\n", name);
    return name;
  }

  void AddObject() {
    const SolidMass& mass = solid_.mass;
    const Eigen::Matrix3d& I = mass.inertia;
    const Attitude first(setup_.demonstration.frames.front().world_from_object);
    bodies_ += fmt::format(
        "    <body name=\"object\" pos=\"{}\" quat=\"{}\">\n      <freejoint name=\"object\"/>\n"
        "      <inertial pos=\"{:.9g} {:.9g} {:.9g}\" mass=\"{:.9g}\" fullinertia=\"{:.9g} {:.9g} "
        "{:.9g} {:.9g} {:.9g} {:.9g}\"/>\n",
        first.Place(), first.Turn(), mass.center.x(), mass.center.y(), mass.center.z(),
        mass.mass_kg, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    for (const TriangleMesh& piece : solid_.pieces) {
      bodies_ += fmt::format(
          "      <geom type=\"mesh\" mesh=\"{}\" rgba=\"0.86 0.62 0.28 1\" contype=\"1\" "
          "conaffinity=\"2\"/>\n",
          Asset(piece));
    }
    bodies_ += "    </body>\n";
  }

  void AddLink(int k, const Eigen::Isometry3d& pose, int depth) {
    const RobotLink& link = hand_.links[k];
    const std::string indent(2 * static_cast<std::size_t>(depth), ' ');
    const Attitude place(pose);
    bodies_ += fmt::format("{}<body name=\"{}\" pos=\"{}\" quat=\"{}\">\n", indent, Safe(link.name),
                           place.Place(), place.Turn());
    if (k == 0) bodies_ += indent + "  <freejoint name=\"wrist\"/>\n";
    if (Moves(k)) {
      joints_.push_back(k);
      AddJoint(link, indent);
    }
    bool weighs = false;
    for (const TriangleMesh& shape : link.shapes) {
      const TriangleMesh hull = ConvexHull(shape.vertices);
      if (hull.NumFaces() == 0) continue;
      weighs = true;
      bodies_ += fmt::format(
          "{}  <geom type=\"mesh\" mesh=\"{}\" density=\"1000\" rgba=\"0.5 0.55 0.6 1\" "
          "contype=\"2\" conaffinity=\"1\"/>\n",
          indent, Asset(hull));
    }
    if (!weighs) {
      bodies_ +=
          indent + "  <inertial pos=\"0 0 0\" mass=\"0.001\" diaginertia=\"1e-6 1e-6 1e-6\"/>\n";
    }
    for (const int child : children_[k]) AddLink(child, ParentFromLink(child), depth + 1);
    bodies_ += indent + "</body>\n";
  }

  // Model pose: at zero if a joint moves the link, otherwise at its fixed value.
  Eigen::Isometry3d ParentFromLink(int k) const {
    const RobotLink& link = hand_.links[k];
    Eigen::Isometry3d pose = link.parent_from_joint;
    if (Moves(k)) return pose;
    const double value = JointValue(link, poses_.front().q);
    link.kind == RobotJointKind::kSliding ? pose.translate(value * link.axis)
                                          : pose.rotate(Eigen::AngleAxisd(value, link.axis));
    return pose;
  }

  void AddJoint(const RobotLink& link, const std::string& indent) {
    const RobotDof& dof = hand_.dofs[link.dof];
    const Drive& drive = DriveOf(link);
    const auto [low, high] =
        std::minmax({link.factor * dof.low + link.offset, link.factor * dof.high + link.offset});
    bodies_ += fmt::format(
        "{}  <joint name=\"{}\" type=\"{}\" axis=\"{:.9g} {:.9g} {:.9g}\" range=\"{:.9g} {:.9g}\" "
        "limited=\"true\" damping=\"{:.9g}\" armature=\"{:.9g}\"/>\n",
        indent, Safe(link.joint), drive.type, link.axis.x(), link.axis.y(), link.axis.z(), low,
        high, drive.damping, drive.inertia);
    if (link.joint != dof.name) {
      equality_ +=
          fmt::format("    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:.9g} {:.9g} 0 0 0\"/>\n",
                      Safe(link.joint), Safe(dof.name), link.offset, link.factor);
      return;
    }
    actuators_ += fmt::format(
        "    <position name=\"{0}\" joint=\"{0}\" kp=\"{1:.9g}\" forcelimited=\"true\" "
        "forcerange=\"-{2:.9g} {2:.9g}\"/>\n",
        Safe(link.joint), drive.stiffness, drive.most);
  }

  // Actuator target: the pose plus the offset for the squeeze, limited to the actuator's range.
  double Pull(const RobotLink& link, const Eigen::VectorXd& q,
              const Eigen::VectorXd& torques) const {
    const Drive& drive = DriveOf(link);
    return JointValue(link, q) +
           std::clamp(torques(link.dof) / link.factor, -drive.most, drive.most) / drive.stiffness;
  }

  std::string Keys() const {
    std::string keys;
    std::optional<Attitude> object, root;
    for (std::size_t t = 0; t < poses_.size(); ++t) {
      const HumanFrame& frame = setup_.demonstration.frames[t];
      object = Attitude(frame.world_from_object, object ? &*object : nullptr);
      root = Attitude(WorldFromRoot(t), root ? &*root : nullptr);
      Eigen::VectorXd torques = Eigen::VectorXd::Zero(hand_.NumDofs());
      if (frame.holds) {
        torques =
            GripTorques(hand_, poses_[t].q, GripOfRobot(setup_, poses_[t], solid_, protocol_));
      }
      std::string values, pulls;
      for (const int k : joints_) {
        const RobotLink& link = hand_.links[k];
        values += fmt::format(" {:.7g}", JointValue(link, poses_[t].q));
        if (Leads(k)) pulls += fmt::format(" {:.7g}", Pull(link, poses_[t].q, torques));
      }
      keys += fmt::format(
          "    <key name=\"frame_{}\" time=\"{:.9g}\" qpos=\"{} {} {} {}{}\" ctrl=\"{}\" "
          "mpos=\"{}\" mquat=\"{}\"/>\n",
          t, static_cast<double>(t) / setup_.demonstration.frame_rate, object->Place(),
          object->Turn(), root->Place(), root->Turn(), values,
          pulls.empty() ? pulls : pulls.substr(1), root->Place(), root->Turn());
    }
    return keys;
  }

  const RobotTransferSetup& setup_;
  const std::vector<RobotPose>& poses_;
  const RobotHand& hand_;
  std::set<int> own_;
  std::vector<int> joints_;  // of links, in the scene's order
  TrialProtocol protocol_;
  TrialSolid solid_;
  fs::path assets_;
  std::vector<std::vector<int>> children_;
  int pieces_ = 0;
  std::string asset_, bodies_, equality_, actuators_;
};

}  // namespace

void WriteRobotScene(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                     const fs::path& path, int threads) {
  WriteAtomically(path, SceneWriter(setup, poses, path, threads).Text());
}

namespace {

constexpr double kHingeSide_Nm = 50.0;  // per radian, keeps a ball joint on its hinge axis

// Robot links as trial links: rigid links are merged into the moving link they are attached to.
std::vector<MjcfLink> TrialLinks(const RobotTransferSetup& setup, const RobotPose& pose,
                                 const FingerStrength& strength, std::vector<int>& body_of) {
  const RobotHand& robot = setup.robot;
  RobotState state(robot);
  state.Evaluate(pose.q);
  std::vector<MjcfLink> links(1);
  std::vector<int> frame_of{0};  // the robot link whose frame a trial link has
  body_of.assign(robot.links.size(), 0);
  for (int k = 0; k < robot.NumLinks(); ++k) {
    const RobotLink& link = robot.links[k];
    const int parent = link.parent < 0 ? 0 : body_of[link.parent];
    body_of[k] = parent;
    if (link.dof >= 0) {
      body_of[k] = static_cast<int>(links.size());
      const Eigen::Isometry3d parent_from_link =
          (parent == 0 ? Eigen::Isometry3d::Identity()
                       : state.RootFromLink(frame_of[parent]).inverse()) *
          state.RootFromLink(k);
      MjcfLink body;
      body.parent = parent;
      body.joint = parent_from_link.translation();
      body.rest = Eigen::Quaterniond(parent_from_link.linear());
      body.axes = SpringAxes(link.axis);
      body.stiffness_Nm << strength.stiffness_Nm(0), kHingeSide_Nm, kHingeSide_Nm;
      body.limit_Nm << strength.torque_limit_Nm(0), 0.0, 0.0;
      links.push_back(body);
      frame_of.push_back(k);
    }
    if (std::ranges::count(setup.solids->Links(), k) == 0) continue;
    const Eigen::Isometry3d body_from_link =
        (body_of[k] == 0 ? Eigen::Isometry3d::Identity()
                         : state.RootFromLink(frame_of[body_of[k]]).inverse()) *
        state.RootFromLink(k);
    for (const TriangleMesh& shape : robot.links[k].shapes) {
      TriangleMesh hull = ConvexHull(shape.vertices);
      if (hull.NumFaces() == 0) continue;
      hull.vertices = body_from_link * hull.vertices;
      links[body_of[k]].pieces.push_back(std::move(hull));
    }
  }
  return links;
}

}  // namespace

int FullestFrame(const HumanDemonstration& demonstration) {
  const auto fullest = std::ranges::max_element(
      demonstration.frames, {}, [](const HumanFrame& f) { return f.contacts.size(); });
  return static_cast<int>(fullest - demonstration.frames.begin());
}

std::optional<HoldTrial> TryRobotHold(const RobotTransferSetup& setup, const RobotPose& pose,
                                      const TrialSolid& solid, const TrialProtocol& protocol) {
  const bool slides = std::ranges::any_of(setup.robot.links, [](const RobotLink& link) {
    return link.dof >= 0 && link.kind == RobotJointKind::kSliding;
  });
  if (slides) return std::nullopt;
  std::vector<int> body_of;
  const std::vector<MjcfLink> links = TrialLinks(setup, pose, protocol.fingers, body_of);
  std::vector<GripContact> contacts = GripOfRobot(setup, pose, solid, protocol);
  for (GripContact& contact : contacts) contact.link = body_of[contact.link];
  return TryHold(links, contacts, solid, pose.ObjectFromRoot().inverse(), protocol);
}

HoldTrial TryHumanHold(const RobotTransferSetup& setup, const Clip& clip, int frame,
                       const TrialSolid& solid, const TrialProtocol& protocol) {
  HandState human(*setup.human);
  human.SetBody(clip.pose[frame], clip.trans.col(frame));
  human.Evaluate(FingersOf(clip.pose[frame], setup.demonstration.side), false);
  return TryHold(human, setup.demonstration.frames[frame].world_from_object, solid,
                 *setup.object_distance, protocol);
}

}  // namespace holdfast
