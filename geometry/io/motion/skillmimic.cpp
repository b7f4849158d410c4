// SPDX-License-Identifier: MIT
#include "geometry/io/motion/skillmimic.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/io/pickle/data_file.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kSkillMimicRate = 60.0;
constexpr double kBallRadius = 0.12;  // meters
constexpr int kBodies = 53;
// Offsets of the parts of a frame.
constexpr int kRootPosition = 0, kRootTurn = 3, kJointTurns = 9, kBodyPositions = 165, kBall = 324,
              kBallContact = 336;
constexpr double kTouches = 0.5;

struct NamedBody {
  const char* name;
  int parent;
};

// Depth first, as in the file; one side after the other.
std::vector<NamedBody> Bodies() {
  std::vector<NamedBody> bodies = {{"Pelvis", -1}};
  const auto add = [&](const char* name, int parent) {
    bodies.push_back({name, parent});
    return static_cast<int>(bodies.size()) - 1;
  };
  const auto chain = [&](std::initializer_list<const char*> names, int parent) {
    for (const char* name : names) parent = add(name, parent);
    return parent;
  };
  chain({"L_Hip", "L_Knee", "L_Ankle", "L_Toe"}, 0);
  chain({"R_Hip", "R_Knee", "R_Ankle", "R_Toe"}, 0);
  const int chest = chain({"Torso", "Spine", "Spine2", "Chest"}, 0);
  chain({"Neck", "Head"}, chest);
  const int left = chain({"L_Thorax", "L_Shoulder", "L_Elbow", "L_Wrist"}, chest);
  chain({"L_Index1", "L_Index2", "L_Index3"}, left);
  chain({"L_Middle1", "L_Middle2", "L_Middle3"}, left);
  chain({"L_Pinky1", "L_Pinky2", "L_Pinky3"}, left);
  chain({"L_Ring1", "L_Ring2", "L_Ring3"}, left);
  chain({"L_Thumb1", "L_Thumb2", "L_Thumb3"}, left);
  const int right = chain({"R_Thorax", "R_Shoulder", "R_Elbow", "R_Wrist"}, chest);
  chain({"R_Index1", "R_Index2", "R_Index3"}, right);
  chain({"R_Middle1", "R_Middle2", "R_Middle3"}, right);
  chain({"R_Pinky1", "R_Pinky2", "R_Pinky3"}, right);
  chain({"R_Ring1", "R_Ring2", "R_Ring3"}, right);
  chain({"R_Thumb1", "R_Thumb2", "R_Thumb3"}, right);
  return bodies;
}

Eigen::MatrixXd FiniteFrames(const DataValue& root) {
  const NpyMember member = root.Array();
  member.RequireShape({-1, kSkillMimicColumns});
  const auto frames = static_cast<Eigen::Index>(member.array.shape[0]);
  if (frames == 0) throw Error(member.where, "has no frames", "Give at least one frame");
  if (static_cast<double>(frames) * kBodies > kMaxJointFrames) {
    throw Error(member.where, fmt::format("has {} frames", frames), "Cut it into clips");
  }
  const std::vector<double> values = member.AsDoubles();
  Eigen::MatrixXd table =
      Eigen::Map<const Eigen::MatrixXd>(values.data(), kSkillMimicColumns, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (int c = 0; c < kSkillMimicColumns; ++c) {
      if (std::isfinite(table(c, t))) continue;
      throw Error(member.where, fmt::format("holds {} in frame {}, column {}", table(c, t), t, c),
                  "Give finite numbers: cut such frames out or fill them in");
    }
  }
  return table;
}

void AddRotations(const Eigen::MatrixXd& table, const std::vector<NamedBody>& bodies,
                  SourceMotion& motion) {
  motion.rotations.resize(static_cast<std::size_t>(table.cols()) * bodies.size());
  const auto turn = [&](Eigen::Index t, int column) {
    return Eigen::Quaterniond(ExpSO3(table.block<3, 1>(column, t)));
  };
  for (Eigen::Index t = 0; t < table.cols(); ++t) {
    Eigen::Quaterniond* const q = &motion.rotations[static_cast<std::size_t>(t) * bodies.size()];
    q[0] = turn(t, kRootTurn);
    for (std::size_t j = 1; j < bodies.size(); ++j) {
      const int column = kJointTurns + 3 * static_cast<int>(j - 1);
      q[j] = (q[bodies[j].parent] * turn(t, column)).normalized();
    }
  }
}

// Mean directions in the parent's frame, at the mean lengths between the positions.
void AddOffsets(const Eigen::MatrixXd& table, const std::vector<NamedBody>& bodies,
                SourceMotion& motion) {
  motion.rest_offsets.setZero(3, kBodies);
  for (int j = 1; j < kBodies; ++j) {
    const int parent = bodies[static_cast<std::size_t>(j)].parent;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double length = 0;
    for (Eigen::Index t = 0; t < table.cols(); ++t) {
      const Eigen::Vector3d bone = table.block<3, 1>(kBodyPositions + 3 * j, t) -
                                   table.block<3, 1>(kBodyPositions + 3 * parent, t);
      sum += motion.Rotation(static_cast<int>(t), parent).conjugate() * bone;
      length += bone.norm() / static_cast<double>(table.cols());
    }
    if (sum.norm() > 0) motion.rest_offsets.col(j) = length * sum.normalized();
  }
}

// Positions of body and ball over the frames, from the file's z-up world to a y-up world.
void AddPositions(const Eigen::MatrixXd& table, const std::vector<NamedBody>& bodies,
                  SourceMotion& motion) {
  const Eigen::Quaterniond upright(
      Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
  SourceMotion::Prop& ball = *motion.prop;
  ball.positions.resize(3, table.cols());
  for (Eigen::Quaterniond& q : motion.rotations) q = upright * q;
  for (Eigen::Index t = 0; t < table.cols(); ++t) {
    Eigen::Matrix3Xd positions(3, kBodies);
    positions.col(0) = upright * Eigen::Vector3d(table.block<3, 1>(kRootPosition, t));
    for (int j = 1; j < kBodies; ++j) {
      const int parent = bodies[static_cast<std::size_t>(j)].parent;
      positions.col(j) = positions.col(parent) +
                         motion.Rotation(static_cast<int>(t), parent) * motion.rest_offsets.col(j);
    }
    motion.positions.push_back(std::move(positions));
    ball.positions.col(t) = upright * Eigen::Vector3d(table.block<3, 1>(kBall, t));
  }
  ball.rotations.assign(static_cast<std::size_t>(table.cols()), Eigen::Quaterniond::Identity());
}

TriangleMesh BallMesh() {
  TriangleMesh mesh = LoadObject("sphere").mesh;
  mesh.vertices.colwise() -= mesh.vertices.rowwise().mean().eval();
  for (auto vertex : mesh.vertices.colwise()) vertex *= kBallRadius / vertex.norm();
  return mesh;
}

}  // namespace

bool MayBeSkillMimic(std::string_view head) {
  constexpr std::size_t kFirstName = 256;  // torch writes its pickle first
  return head.starts_with("PK\3\4") && head.substr(0, kFirstName).find("data.pkl") != head.npos;
}

bool LooksLikeSkillMimic(const DataValue& root) {
  if (root.Kind() != DataKind::kArray) return false;
  const std::vector<std::size_t> shape = root.Array().array.shape;
  return shape.size() == 2 && shape[1] == kSkillMimicColumns;
}

SourceMotion ReadSkillMimic(const DataValue& root) {
  const Eigen::MatrixXd table = FiniteFrames(root);
  const std::vector<NamedBody> bodies = Bodies();
  SourceMotion motion;
  motion.format = "SkillMimic";
  motion.frame_rate = kSkillMimicRate;
  for (const NamedBody& body : bodies) {
    motion.joint_names.emplace_back(body.name);
    motion.parents.push_back(body.parent);
  }
  motion.prop.emplace();
  motion.prop->name = "ball";
  motion.prop->mesh = BallMesh();
  AddRotations(table, bodies, motion);
  AddOffsets(table, bodies, motion);
  AddPositions(table, bodies, motion);
  motion.notes.push_back(fmt::format(
      "the file marks contact of a hand with the ball in {} of {} frames; its rotation is not "
      "recorded",
      (table.row(kBallContact).array() > kTouches).count(), table.cols()));
  if (table.middleRows(kJointTurns + 3 * 17, 45).isZero(0.0) &&
      table.middleRows(kJointTurns + 3 * 36, 45).isZero(0.0)) {
    motion.notes.emplace_back("no finger moves: hands are flat in every frame");
  }
  return motion;
}

SourceMotion ReadSkillMimic(const std::filesystem::path& path) {
  return ReadSkillMimic(DataFile(path).Root());
}

}  // namespace holdfast
