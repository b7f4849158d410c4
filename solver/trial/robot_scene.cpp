// SPDX-License-Identifier: MIT
#include "solver/trial/robot_scene.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/temporary_folder.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/rotation.h"
#include "solver/robot/robot_measures.h"
#include "solver/trial/scene_play.h"

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

// Offsets of the actuators' targets from the pose, one per degree of freedom: they close the gaps
// of the contacts that press, and then exert the presses.
Eigen::VectorXd GripOffsets(const RobotHand& robot, const Eigen::VectorXd& q,
                            const std::vector<GripContact>& contacts) {
  constexpr double kLazy_m = 1e-3;  // per radian: of several joints that close a gap, all move
  RobotState state(robot);
  state.Evaluate(q);
  const Eigen::MatrixXd slopes = ContactSlopes(state, contacts);
  Eigen::VectorXd presses(slopes.rows()), gaps = Eigen::VectorXd::Zero(std::ssize(contacts));
  Eigen::MatrixXd inward = Eigen::MatrixXd::Zero(std::ssize(contacts), robot.NumDofs());
  for (Eigen::Index c = 0; c < std::ssize(contacts); ++c) {
    const GripContact& contact = contacts[static_cast<std::size_t>(c)];
    presses.segment<3>(3 * c) = contact.press;
    if (contact.press.dot(contact.into) <= 0.0) continue;
    inward.row(c) = contact.into.transpose() * slopes.middleRows<3>(3 * c);
    gaps(c) = contact.gap_m;
  }
  const Eigen::VectorXd torques = slopes.transpose() * presses;
  Eigen::MatrixXd normal = inward.transpose() * inward;
  normal.diagonal().array() += kLazy_m * kLazy_m;
  Eigen::VectorXd offsets = normal.ldlt().solve(inward.transpose() * gaps);
  for (const RobotLink& link : robot.links) {
    if (link.dof < 0 || link.joint != robot.dofs[link.dof].name) continue;
    const Drive& drive = DriveOf(link);
    offsets(link.dof) += std::clamp(torques(link.dof), -drive.most, drive.most) / drive.stiffness;
  }
  return offsets;
}

std::string Safe(const std::string& name) {
  std::string safe;
  for (const char c : name) {
    safe += std::string_view("<>&\"'/\\").find(c) == std::string_view::npos ? c : '_';
  }
  return safe;
}

// Text of a scene, by section, and the meshes that it names.
struct SceneText {
  fs::path assets;
  std::string asset, bodies, equality, actuators;
  int pieces = 0;

  std::string Asset(const TriangleMesh& mesh) {
    const std::string name = fmt::format("piece_{}", pieces++);
    WriteMesh(mesh, assets / (name + ".obj"));
    asset += fmt::format("    <mesh name=\"{0}\" file=\"{0}.obj\"/>\n", name);
    return name;
  }
};

void AddObject(const TrialSolid& solid, const Eigen::Isometry3d& pose, SceneText& scene) {
  const SolidMass& mass = solid.mass;
  const Eigen::Matrix3d& I = mass.inertia;
  const Attitude first(pose);
  scene.bodies += fmt::format(
      "    <body name=\"object\" pos=\"{}\" quat=\"{}\">\n      <freejoint name=\"object\"/>\n"
      "      <inertial pos=\"{:.9g} {:.9g} {:.9g}\" mass=\"{:.9g}\" fullinertia=\"{:.9g} {:.9g} "
      "{:.9g} {:.9g} {:.9g} {:.9g}\"/>\n",
      first.Place(), first.Turn(), mass.center.x(), mass.center.y(), mass.center.z(), mass.mass_kg,
      I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
  for (const TriangleMesh& piece : solid.pieces) {
    scene.bodies += fmt::format(
        "      <geom type=\"mesh\" mesh=\"{}\" rgba=\"0.86 0.62 0.28 1\" contype=\"1\" "
        "conaffinity=\"2\"/>\n",
        scene.Asset(piece));
  }
  scene.bodies += "    </body>\n";
}

// Adds one robot hand to a scene.
class RobotWriter {
 public:
  // `prefix`: of all names.
  RobotWriter(const RobotInScene& robot, std::string prefix, const TrialSolid& solid)
      : setup_(*robot.setup),
        poses_(*robot.poses),
        hand_(setup_.robot),
        prefix_(std::move(prefix)),
        own_(HandJoints(setup_)),
        solid_(solid),
        children_(hand_.links.size()) {
    for (int k = 1; k < hand_.NumLinks(); ++k) children_[hand_.links[k].parent].push_back(k);
  }

  void AddTo(SceneText& scene) {
    const Attitude first(WorldFromRoot(0));
    const std::string target = prefix_ + "wrist_target";
    scene.bodies += fmt::format("    <body name=\"{}\" mocap=\"true\" pos=\"{}\" quat=\"{}\"/>\n",
                                target, first.Place(), first.Turn());
    AddLink(0, WorldFromRoot(0), 2, scene);
    scene.equality += fmt::format(
        "    <weld body1=\"{}\" body2=\"{}\" solref=\"0.005 1\" solimp=\"0.99 0.999 0.001\"/>\n",
        target, Name(hand_.links[0].name));
  }

  // Values of one key frame.
  struct Key {
    Attitude root;
    std::string joints, pulls;
  };
  Key KeyAt(std::size_t t) {
    Key key{Attitude(WorldFromRoot(t), root_ ? &*root_ : nullptr), "", ""};
    root_ = key.root;
    Eigen::VectorXd targets = poses_[t].q;
    if (setup_.demonstration.frames[t].holds) {
      targets +=
          GripOffsets(hand_, poses_[t].q, GripOfRobot(setup_, poses_[t], solid_, TrialProtocol()));
    }
    for (const int k : joints_) {
      const RobotLink& link = hand_.links[k];
      key.joints += fmt::format(" {:.7g}", JointValue(link, poses_[t].q));
      if (Leads(k)) key.pulls += fmt::format(" {:.7g}", JointValue(link, targets));
    }
    return key;
  }

 private:
  std::string Name(const std::string& name) const { return prefix_ + Safe(name); }
  Eigen::Isometry3d WorldFromRoot(std::size_t t) const {
    return setup_.demonstration.frames[t].world_from_object * poses_[t].ObjectFromRoot();
  }
  bool Moves(int link) const { return own_.contains(link); }
  // Whether it has its own joint and actuator.
  bool Leads(int link) const {
    return hand_.links[link].joint == hand_.dofs[hand_.links[link].dof].name;
  }

  void AddLink(int k, const Eigen::Isometry3d& pose, int depth, SceneText& scene) {
    const RobotLink& link = hand_.links[k];
    const std::string indent(2 * static_cast<std::size_t>(depth), ' ');
    const Attitude place(pose);
    scene.bodies += fmt::format("{}<body name=\"{}\" pos=\"{}\" quat=\"{}\">\n", indent,
                                Name(link.name), place.Place(), place.Turn());
    if (k == 0) scene.bodies += fmt::format("{}  <freejoint name=\"{}wrist\"/>\n", indent, prefix_);
    if (Moves(k)) {
      joints_.push_back(k);
      AddJoint(link, indent, scene);
    }
    bool weighs = false;
    for (const TriangleMesh& shape : link.shapes) {
      const TriangleMesh hull = ConvexHull(shape.vertices);
      if (hull.NumFaces() == 0) continue;
      weighs = true;
      scene.bodies += fmt::format(
          "{}  <geom type=\"mesh\" mesh=\"{}\" density=\"1000\" rgba=\"0.5 0.55 0.6 1\" "
          "contype=\"2\" conaffinity=\"1\"/>\n",
          indent, scene.Asset(hull));
    }
    if (!weighs) {
      scene.bodies +=
          indent + "  <inertial pos=\"0 0 0\" mass=\"0.001\" diaginertia=\"1e-6 1e-6 1e-6\"/>\n";
    }
    for (const int child : children_[k]) AddLink(child, ParentFromLink(child), depth + 1, scene);
    scene.bodies += indent + "</body>\n";
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

  void AddJoint(const RobotLink& link, const std::string& indent, SceneText& scene) const {
    const RobotDof& dof = hand_.dofs[link.dof];
    const Drive& drive = DriveOf(link);
    const auto [low, high] =
        std::minmax({link.factor * dof.low + link.offset, link.factor * dof.high + link.offset});
    scene.bodies += fmt::format(
        "{}  <joint name=\"{}\" type=\"{}\" axis=\"{:.9g} {:.9g} {:.9g}\" range=\"{:.9g} {:.9g}\" "
        "limited=\"true\" damping=\"{:.9g}\" armature=\"{:.9g}\"/>\n",
        indent, Name(link.joint), drive.type, link.axis.x(), link.axis.y(), link.axis.z(), low,
        high, drive.damping, drive.inertia);
    if (link.joint != dof.name) {
      scene.equality +=
          fmt::format("    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:.9g} {:.9g} 0 0 0\"/>\n",
                      Name(link.joint), Name(dof.name), link.offset, link.factor);
      return;
    }
    scene.actuators += fmt::format(
        "    <position name=\"{0}\" joint=\"{0}\" kp=\"{1:.9g}\" forcelimited=\"true\" "
        "forcerange=\"-{2:.9g} {2:.9g}\"/>\n",
        Name(link.joint), drive.stiffness, drive.most);
  }

  const RobotTransferSetup& setup_;
  const std::vector<RobotPose>& poses_;
  const RobotHand& hand_;
  std::string prefix_;
  std::set<int> own_;
  const TrialSolid& solid_;
  std::vector<std::vector<int>> children_;
  std::vector<int> joints_;       // of links, in the scene's order
  std::optional<Attitude> root_;  // of the last key
};

std::string Keys(const HumanDemonstration& demonstration, std::vector<RobotWriter>& writers) {
  std::string keys;
  std::optional<Attitude> object;
  for (std::size_t t = 0; t < demonstration.frames.size(); ++t) {
    object = Attitude(demonstration.frames[t].world_from_object, object ? &*object : nullptr);
    std::string state = object->Place() + " " + object->Turn(), pulls, places, turns;
    for (RobotWriter& writer : writers) {
      const RobotWriter::Key key = writer.KeyAt(t);
      state += fmt::format(" {} {}{}", key.root.Place(), key.root.Turn(), key.joints);
      pulls += key.pulls;
      places += " " + key.root.Place();
      turns += " " + key.root.Turn();
    }
    keys += fmt::format(
        "    <key name=\"frame_{}\" time=\"{:.9g}\" qpos=\"{}\" ctrl=\"{}\" mpos=\"{}\" "
        "mquat=\"{}\"/>\n",
        t, static_cast<double>(t) / demonstration.frame_rate, state,
        pulls.empty() ? pulls : pulls.substr(1), places.substr(1), turns.substr(1));
  }
  return keys;
}

}  // namespace

void WriteRobotScene(std::span<const RobotInScene> robots, const TrialSolid& solid,
                     const fs::path& path) {
  const HumanDemonstration& demonstration = robots.front().setup->demonstration;
  const TrialProtocol protocol;
  SceneText scene;
  scene.assets = MjcfAssets(path);
  fs::create_directories(scene.assets);
  AddObject(solid, demonstration.frames.front().world_from_object, scene);
  std::vector<RobotWriter> writers;
  std::vector<std::string> names;
  for (const RobotInScene& robot : robots) {
    const std::string side(SideName(robot.setup->anatomy.side));
    writers.emplace_back(robot, robots.size() > 1 ? side + "_" : std::string(), solid).AddTo(scene);
    names.push_back(Safe(robot.setup->robot.name));
  }
  WriteAtomically(
      path, fmt::format("<mujoco model=\"{}\">\n"
                        "  <compiler angle=\"radian\" meshdir=\"{}\"/>\n"
                        "  <option timestep=\"{:.9g}\" cone=\"elliptic\" impratio=\"10\" "
                        "noslip_iterations=\"3\"/>\n"
                        "  <custom><numeric name=\"frame_rate\" data=\"{:.9g}\"/></custom>\n"
                        "  <default><geom condim=\"4\" friction=\"{:.9g} {:.9g} 0.0001\" "
                        "solref=\"0.005 1\"/></default>\n"
                        "  <asset>\n{}  </asset>\n  <worldbody>\n"
                        "    <light pos=\"0 -1 3\" dir=\"0 0.3 -1\"/>\n"
                        "    <geom name=\"floor\" type=\"plane\" size=\"3 3 0.1\" contype=\"0\" "
                        "conaffinity=\"0\"/>\n{}  </worldbody>\n"
                        "  <equality>\n{}  </equality>\n  <actuator>\n{}  </actuator>\n"
                        "  <keyframe>\n{}  </keyframe>\n</mujoco>\n",
                        fmt::join(names, " and "), scene.assets.filename().string(),
                        protocol.scene.step_s, demonstration.frame_rate, protocol.scene.friction,
                        protocol.scene.torsion_m, scene.asset, scene.bodies, scene.equality,
                        scene.actuators, Keys(demonstration, writers)));
}

RobotPlay PlayRobotTransfer(std::span<const RobotInScene> robots, int threads) {
  RequirePhysics();
  const RobotTransferSetup& setup = *robots.front().setup;
  const std::vector<HumanFrame>& frames = setup.demonstration.frames;
  const auto holds = [&](int t) {
    return std::ranges::any_of(robots, [&](const RobotInScene& robot) {
      return robot.setup->demonstration.frames[t].holds;
    });
  };
  const TemporaryFolder folder;
  TrialProtocol protocol;
  protocol.threads = threads;
  WriteRobotScene(robots, MakeTrialSolid(setup.object, *setup.object_distance, protocol),
                  folder.path / "scene.xml");
  RobotPlay play;
  play.off_mm.assign(frames.size(), std::numeric_limits<double>::quiet_NaN());
  play.off_deg = play.off_mm;
  const Eigen::Vector3d center = setup.object.vertices.rowwise().mean();
  const int count = static_cast<int>(frames.size());
  for (int first = 0, last = 0; first < count; first = last + 1) {
    last = first;
    if (!holds(first)) continue;
    while (last + 1 < count && holds(last + 1)) ++last;
    const ScenePlay scene = PlayScene(folder.path / "scene.xml", first, last);
    ++play.holds;
    play.stable = play.stable && scene.stable;
    for (std::size_t k = 0; k < scene.world_from_object.size(); ++k) {
      const std::size_t t = static_cast<std::size_t>(first) + k;
      const Eigen::Isometry3d &path = frames[t].world_from_object,
                              &played = scene.world_from_object[k];
      play.off_mm[t] = 1e3 * (played * center - path * center).norm();
      play.off_deg[t] =
          LogSO3(path.linear().transpose() * played.linear()).norm() * 180.0 / std::numbers::pi;
      play.most_mm = std::max(play.most_mm, play.off_mm[t]);
      play.most_deg = std::max(play.most_deg, play.off_deg[t]);
    }
  }
  return play;
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
