// SPDX-License-Identifier: MIT
#include "geometry/io/motion/array_motion.h"

#include <cctype>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kBallRadius = 0.12;  // meters
constexpr double kTouches = 0.5;

// A frame of a tensor: offsets of its parts.
struct TensorLayout {
  const char* name;
  int columns;
  double rate_hz;
  bool second_spine;  // a joint Spine2
  int root_turn;      // exponential map or quaternion (x, y, z, w)
  bool root_quaternion;
  int positions;            // of all bodies
  int object, object_turn;  // object_turn -1: it has no rotation
  int contact;
};
constexpr TensorLayout kTensors[] = {
    {"SkillMimic", kSkillMimicColumns, 60.0, true, 3, false, 165, 324, -1, 336},
    {"InterMimic", kInterMimicColumns, 30.0, false, 3, true, 162, 318, 321, 330}};
constexpr int kRootPosition = 0, kJointTurns = 9;

constexpr double kKimodoRate = 30.0;
constexpr const char* kPosed = "posed_joints";
constexpr const char* kGlobal = "global_rot_mats";

const TensorLayout* LayoutOf(const DataValue& root) {
  if (root.Kind() != DataKind::kArray) return nullptr;
  const std::vector<std::size_t> shape = root.Array().array.shape;
  if (shape.size() != 2) return nullptr;
  for (const TensorLayout& layout : kTensors) {
    if (shape[1] == static_cast<std::size_t>(layout.columns)) return &layout;
  }
  return nullptr;
}

// Appends a chain of joints below `parent`; returns the last.
int AddChain(const std::string& prefix, std::initializer_list<const char*> names, int parent,
             SourceMotion& motion) {
  for (const char* name : names) {
    motion.joint_names.push_back(prefix + name);
    motion.parents.push_back(parent);
    parent = motion.NumJoints() - 1;
  }
  return parent;
}

// Depth first, as in the file; one side after the other.
void AddMimicsJoints(bool second_spine, SourceMotion& motion) {
  const int pelvis = AddChain("", {"Pelvis"}, -1, motion);
  for (const char* side : {"L_", "R_"}) {
    AddChain(side, {"Hip", "Knee", "Ankle", "Toe"}, pelvis, motion);
  }
  int chest = AddChain("", {"Torso", "Spine"}, pelvis, motion);
  if (second_spine) chest = AddChain("", {"Spine2"}, chest, motion);
  chest = AddChain("", {"Chest"}, chest, motion);
  AddChain("", {"Neck", "Head"}, chest, motion);
  for (const std::string side : {"L_", "R_"}) {
    const int wrist = AddChain(side, {"Thorax", "Shoulder", "Elbow", "Wrist"}, chest, motion);
    for (const char* finger : {"Index", "Middle", "Pinky", "Ring", "Thumb"}) {
      AddChain(side + finger, {"1", "2", "3"}, wrist, motion);
    }
  }
}

// The skeleton of NVIDIA's SOMA; the short one has of fingers and toes only a few ends.
void AddSomasJoints(bool all, SourceMotion& motion) {
  const int hips = AddChain("", {"Hips"}, -1, motion);
  const int chest = AddChain("", {"Spine1", "Spine2", "Chest"}, hips, motion);
  const int head = AddChain("", {"Neck1", "Neck2", "Head"}, chest, motion);
  if (all) AddChain("", {"HeadEnd"}, head, motion);
  for (const char* name : {"Jaw", "LeftEye", "RightEye"}) AddChain("", {name}, head, motion);
  for (const std::string side : {"Left", "Right"}) {
    const int hand = AddChain(side, {"Shoulder", "Arm", "ForeArm", "Hand"}, chest, motion);
    if (!all) {
      AddChain(side, {"HandThumbEnd"}, hand, motion);
      AddChain(side, {"HandMiddleEnd"}, hand, motion);
      continue;
    }
    AddChain(side + "HandThumb", {"1", "2", "3", "End"}, hand, motion);
    for (const char* finger : {"HandIndex", "HandMiddle", "HandRing", "HandPinky"}) {
      AddChain(side + finger, {"1", "2", "3", "4", "End"}, hand, motion);
    }
  }
  for (const std::string side : {"Left", "Right"}) {
    const int toes = AddChain(side, {"Leg", "Shin", "Foot", "ToeBase"}, hips, motion);
    if (all) AddChain(side, {"ToeEnd"}, toes, motion);
  }
}

void RequireFrames(const std::string& where, Eigen::Index frames, int joints) {
  if (frames == 0) throw Error(where, "has no frames", "Give at least one frame");
  if (static_cast<double>(frames) * joints > kMaxJointFrames) {
    throw Error(where, fmt::format("has {} frames", frames), "Cut it into clips");
  }
}

// A row of numbers for each frame, as columns.
Eigen::MatrixXd FiniteFrames(const DataValue& value, Eigen::Index columns, int joints) {
  const NpyMember member = value.Array();
  const std::vector<double> values = member.AsDoubles();
  const Eigen::Index frames = std::ssize(values) / columns;
  RequireFrames(member.where, frames, joints);
  Eigen::MatrixXd table = Eigen::Map<const Eigen::MatrixXd>(values.data(), columns, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      if (std::isfinite(table(c, t))) continue;
      throw Error(member.where, fmt::format("holds {} in frame {}, column {}", table(c, t), t, c),
                  "Give finite numbers: cut such frames out or fill them in");
    }
  }
  return table;
}

Eigen::Quaterniond TurnOfQuaternion(const Eigen::Vector4d& xyzw, const std::string& where,
                                    Eigen::Index frame) {
  if (!(xyzw.norm() > 0.5 && xyzw.norm() < 2.0)) {
    throw Error(where, fmt::format("has no rotation in frame {}", frame),
                "Give quaternions of length 1");
  }
  return Eigen::Quaterniond(xyzw).normalized();  // Eigen's order is x, y, z, w
}

void AddRotations(const Eigen::MatrixXd& table, const TensorLayout& layout,
                  const std::string& where, SourceMotion& motion) {
  const int bodies = motion.NumJoints();
  motion.rotations.resize(static_cast<std::size_t>(table.cols()) * bodies);
  const auto turn = [&](Eigen::Index t, int column) {
    return Eigen::Quaterniond(ExpSO3(table.block<3, 1>(column, t)));
  };
  for (Eigen::Index t = 0; t < table.cols(); ++t) {
    Eigen::Quaterniond* const q = &motion.rotations[static_cast<std::size_t>(t) * bodies];
    q[0] = layout.root_quaternion
               ? TurnOfQuaternion(table.block<4, 1>(layout.root_turn, t), where, t)
               : turn(t, layout.root_turn);
    for (int j = 1; j < bodies; ++j) {
      q[j] = (q[motion.parents[j]] * turn(t, kJointTurns + 3 * (j - 1))).normalized();
    }
  }
}

// Mean directions in the parent's frame, at the mean lengths between the positions: three rows of
// `table` for each joint, from `begin` on.
void AddOffsets(const Eigen::MatrixXd& table, int begin, SourceMotion& motion) {
  const int joints = motion.NumJoints();
  motion.rest_offsets.setZero(3, joints);
  for (int j = 1; j < joints; ++j) {
    const int parent = motion.parents[j];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double length = 0;
    for (Eigen::Index t = 0; t < table.cols(); ++t) {
      const Eigen::Vector3d bone =
          table.block<3, 1>(begin + 3 * j, t) - table.block<3, 1>(begin + 3 * parent, t);
      sum += motion.Rotation(static_cast<int>(t), parent).conjugate() * bone;
      length += bone.norm() / static_cast<double>(table.cols());
    }
    if (sum.norm() > 0) motion.rest_offsets.col(j) = length * sum.normalized();
  }
}

// Positions over the frames from those of the root (3 x T), with the world turned by `upright`.
void AddPositions(const Eigen::Matrix3Xd& root, const Eigen::Quaterniond& upright,
                  SourceMotion& motion) {
  for (Eigen::Quaterniond& q : motion.rotations) q = upright * q;
  for (Eigen::Index t = 0; t < root.cols(); ++t) {
    Eigen::Matrix3Xd positions(3, motion.NumJoints());
    positions.col(0) = upright * Eigen::Vector3d(root.col(t));
    for (int j = 1; j < motion.NumJoints(); ++j) {
      const int parent = motion.parents[j];
      positions.col(j) = positions.col(parent) +
                         motion.Rotation(static_cast<int>(t), parent) * motion.rest_offsets.col(j);
    }
    motion.positions.push_back(std::move(positions));
  }
}

TriangleMesh BallMesh() {
  TriangleMesh mesh = LoadObject("sphere").mesh;
  mesh.vertices.colwise() -= mesh.vertices.rowwise().mean().eval();
  for (auto vertex : mesh.vertices.colwise()) vertex *= kBallRadius / vertex.norm();
  return mesh;
}

// "sub3_largetable_006": largetable.
std::string ObjectOfName(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  const std::size_t begin = stem.find('_'), end = stem.rfind('_');
  return begin == end ? "object" : stem.substr(begin + 1, end - begin - 1);
}

void AddObject(const Eigen::MatrixXd& table, const TensorLayout& layout,
               const Eigen::Quaterniond& upright, const DataFile& file, SourceMotion& motion) {
  SourceMotion::Prop& object = motion.prop.emplace();
  const bool ball = layout.object_turn < 0;
  object.name = ball ? "ball" : ObjectOfName(file.Path());
  if (ball) object.mesh = BallMesh();
  object.positions.resize(3, table.cols());
  for (Eigen::Index t = 0; t < table.cols(); ++t) {
    object.positions.col(t) = upright * Eigen::Vector3d(table.block<3, 1>(layout.object, t));
    object.rotations.push_back(ball ? Eigen::Quaterniond::Identity()
                                    : upright *
                                          TurnOfQuaternion(table.block<4, 1>(layout.object_turn, t),
                                                           file.Path().string(), t));
  }
  motion.notes.push_back(fmt::format(
      "the file marks contact with the {} in {} of {} frames; {}", object.name,
      (table.row(layout.contact).array() > kTouches).count(), table.cols(),
      ball ? "its rotation is not recorded" : "its mesh is not in the file (--object-mesh)"));
}

bool NoFingerMoves(const Eigen::MatrixXd& table, const SourceMotion& motion) {
  for (int j = 1; j < motion.NumJoints(); ++j) {
    const bool finger = std::isdigit(static_cast<unsigned char>(motion.joint_names[j].back())) &&
                        motion.joint_names[j][1] == '_';
    if (finger && !table.middleRows<3>(kJointTurns + 3 * (j - 1)).isZero(0.0)) return false;
  }
  return true;
}

SourceMotion ReadTensor(const DataFile& file, const TensorLayout& layout) {
  SourceMotion motion;
  motion.format = layout.name;
  motion.frame_rate = layout.rate_hz;
  AddMimicsJoints(layout.second_spine, motion);
  const Eigen::MatrixXd table = FiniteFrames(file.Root(), layout.columns, motion.NumJoints());
  // From the file's z-up world.
  const Eigen::Quaterniond upright(
      Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
  AddRotations(table, layout, file.Path().string(), motion);
  AddOffsets(table, layout.positions, motion);
  AddPositions(table.middleRows<3>(kRootPosition), upright, motion);
  AddObject(table, layout, upright, file, motion);
  if (NoFingerMoves(table, motion)) {
    motion.notes.emplace_back("no finger moves: hands are flat in every frame");
  }
  return motion;
}

SourceMotion ReadKimodo(const DataFile& file) {
  const DataValue posed = file[kPosed], global = file[kGlobal];
  const std::vector<std::size_t> shape = posed.Array().array.shape;
  SourceMotion motion;
  motion.format = "Kimodo (SOMA)";
  motion.frame_rate = kKimodoRate;
  AddSomasJoints(shape[1] != 30, motion);
  const int joints = motion.NumJoints();
  posed.Array().RequireShape({-1, joints, 3});
  global.Array().RequireShape({static_cast<std::ptrdiff_t>(shape[0]), joints, 3, 3});
  const Eigen::MatrixXd places = FiniteFrames(posed, 3 * joints, joints);
  const Eigen::MatrixXd turns = FiniteFrames(global, 9 * joints, joints);
  for (Eigen::Index t = 0; t < turns.cols(); ++t) {
    for (int j = 0; j < joints; ++j) {
      // Row-major in the file: the map is the transpose.
      const Eigen::Matrix3d R = turns.block<9, 1>(9 * j, t).reshaped(3, 3).transpose();
      if (!(R.transpose() * R).isIdentity(1e-2) || R.determinant() < 0) {
        throw Error(global.Where(),
                    fmt::format("has no rotation in frame {}, joint {}", t, motion.joint_names[j]),
                    "Check the file");
      }
      motion.rotations.push_back(Eigen::Quaterniond(R).normalized());
    }
  }
  AddOffsets(places, 0, motion);
  AddPositions(places.topRows<3>(), Eigen::Quaterniond::Identity(), motion);
  return motion;
}

}  // namespace

bool MayBeArrayMotion(std::string_view head) {
  constexpr std::size_t kFirstName = 256;  // torch writes its pickle first
  if (!head.starts_with("PK\3\4")) return false;
  const std::string_view first = head.substr(0, kFirstName);
  return first.find("data.pkl") != first.npos || first.find(".npy") != first.npos;
}

bool LooksLikeArrayMotion(const DataFile& file) {
  if (file.Format() != DataFormat::kNpz) return LayoutOf(file.Root()) != nullptr;
  if (!file.Has(kPosed) || !file.Has(kGlobal)) return false;
  const std::vector<std::size_t> shape = file[kPosed].Array().array.shape;
  return shape.size() == 3 && (shape[1] == 77 || shape[1] == 30);
}

SourceMotion ReadArrayMotion(const DataFile& file) {
  if (file.Format() == DataFormat::kNpz) return ReadKimodo(file);
  if (const TensorLayout* const layout = LayoutOf(file.Root())) return ReadTensor(file, *layout);
  throw Error(
      file.Path().string(), "holds no motion of SkillMimic or InterMimic",
      fmt::format("Give a tensor (T, {}) or (T, {})", kSkillMimicColumns, kInterMimicColumns));
}

}  // namespace holdfast
