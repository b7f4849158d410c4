// SPDX-License-Identifier: MIT
#include "geometry/io/motion/skillmimic.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/load_object.h"
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

// Adds the joints: depth first, as in the file; one side after the other.
void AddJoints(SourceMotion& motion) {
  const auto chain = [&](const std::string& prefix, std::initializer_list<const char*> names,
                         int parent) {
    for (const char* name : names) {
      motion.joint_names.push_back(prefix + name);
      motion.parents.push_back(parent);
      parent = motion.NumJoints() - 1;
    }
    return parent;
  };
  const int pelvis = chain("", {"Pelvis"}, -1);
  for (const char* side : {"L_", "R_"}) chain(side, {"Hip", "Knee", "Ankle", "Toe"}, pelvis);
  const int chest = chain("", {"Torso", "Spine", "Spine2", "Chest"}, pelvis);
  chain("", {"Neck", "Head"}, chest);
  for (const std::string side : {"L_", "R_"}) {
    const int wrist = chain(side, {"Thorax", "Shoulder", "Elbow", "Wrist"}, chest);
    for (const char* finger : {"Index", "Middle", "Pinky", "Ring", "Thumb"}) {
      chain(side + finger, {"1", "2", "3"}, wrist);
    }
  }
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

void AddRotations(const Eigen::MatrixXd& table, SourceMotion& motion) {
  motion.rotations.resize(static_cast<std::size_t>(table.cols()) * kBodies);
  const auto turn = [&](Eigen::Index t, int column) {
    return Eigen::Quaterniond(ExpSO3(table.block<3, 1>(column, t)));
  };
  for (Eigen::Index t = 0; t < table.cols(); ++t) {
    Eigen::Quaterniond* const q = &motion.rotations[static_cast<std::size_t>(t) * kBodies];
    q[0] = turn(t, kRootTurn);
    for (int j = 1; j < kBodies; ++j) {
      q[j] = (q[motion.parents[j]] * turn(t, kJointTurns + 3 * (j - 1))).normalized();
    }
  }
}

// Mean directions in the parent's frame, at the mean lengths between the positions.
void AddOffsets(const Eigen::MatrixXd& table, SourceMotion& motion) {
  motion.rest_offsets.setZero(3, kBodies);
  for (int j = 1; j < kBodies; ++j) {
    const int parent = motion.parents[j];
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
void AddPositions(const Eigen::MatrixXd& table, SourceMotion& motion) {
  const Eigen::Quaterniond upright(
      Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
  SourceMotion::Prop& ball = *motion.prop;
  ball.positions.resize(3, table.cols());
  for (Eigen::Quaterniond& q : motion.rotations) q = upright * q;
  for (Eigen::Index t = 0; t < table.cols(); ++t) {
    Eigen::Matrix3Xd positions(3, kBodies);
    positions.col(0) = upright * Eigen::Vector3d(table.block<3, 1>(kRootPosition, t));
    for (int j = 1; j < kBodies; ++j) {
      const int parent = motion.parents[j];
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
  SourceMotion motion;
  motion.format = "SkillMimic";
  motion.frame_rate = kSkillMimicRate;
  AddJoints(motion);
  motion.prop.emplace();
  motion.prop->name = "ball";
  motion.prop->mesh = BallMesh();
  AddRotations(table, motion);
  AddOffsets(table, motion);
  AddPositions(table, motion);
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

}  // namespace holdfast
