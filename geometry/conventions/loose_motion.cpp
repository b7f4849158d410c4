// SPDX-License-Identifier: MIT
#include "geometry/conventions/loose_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/options.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

std::string TypeName(const NpyArray& array) {
  if (array.kind == 'b') return "bool";
  const char* const name = array.kind == 'f'   ? "float"
                           : array.kind == 'i' ? "int"
                           : array.kind == 'u' ? "uint"
                                               : nullptr;
  return name != nullptr ? fmt::format("{}{}", name, 8 * array.item_size) : "text";
}

Eigen::Matrix3d Rotation(const double* p, RotationForm form) {
  switch (form) {
    case RotationForm::kMatrix:
      return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p);
    case RotationForm::kQuaternion: {  // w first, as in the field's Python code
      const Eigen::Quaterniond q(p[0], p[1], p[2], p[3]);
      return q.norm() > 1e-9 ? q.normalized().toRotationMatrix() : Eigen::Matrix3d::Identity();
    }
    case RotationForm::kSixD: {  // the first two columns, in rows of two
      Eigen::Vector3d a(p[0], p[2], p[4]), b(p[1], p[3], p[5]);
      Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
      if (a.norm() < 1e-9 || a.cross(b).norm() < 1e-9) return R;
      R.col(0) = a.normalized();
      R.col(2) = a.cross(b).normalized();
      R.col(1) = R.col(2).cross(R.col(0));
      return R;
    }
    default:
      return ExpSO3(Eigen::Vector3d(p[0], p[1], p[2]));
  }
}

constexpr int kSmplhJoints = 52;
constexpr int kSmplJoints = 24;

// Tries a width against the numbers per rotation of each form, in this order.
std::optional<RotationForm> FormOf(std::size_t width, std::size_t joints) {
  constexpr std::pair<RotationForm, std::size_t> kNumbers[] = {{RotationForm::kAxisAngle, 3},
                                                               {RotationForm::kMatrix, 9},
                                                               {RotationForm::kQuaternion, 4},
                                                               {RotationForm::kSixD, 6}};
  for (const auto& [form, numbers] : kNumbers) {
    if (width == numbers * joints) return form;
  }
  return std::nullopt;
}

class Reader {
 public:
  Reader(const NpzReader& archive, LooseMotion& motion) : archive_(archive), motion_(motion) {}

  // Calls use(member) for an array of the archive, if present. Errors are added to the problems.
  template <typename Use>
  void Try(const char* key, const Use& use) {
    if (!archive_.Has(key)) return;
    try {
      use(archive_.Read(key));
    } catch (const Error& error) {
      motion_.problems.push_back(fmt::format("{} {}", key, error.Problem()));
    }
  }

  // The first of these keys that is present, with its numbers; NaN, infinite and out-of-range
  // numbers become 0.
  struct Rows {
    LooseArray array;
    std::size_t width = 0;
    std::vector<double> values;
  };
  std::optional<Rows> Find(std::initializer_list<const char*> keys, const char* role) {
    std::optional<Rows> found;
    const auto* const key =
        std::ranges::find_if(keys, [&](const char* name) { return archive_.Has(name); });
    if (key == keys.end()) return found;
    Try(*key, [&](const NpyMember& member) {
      Rows rows;
      rows.array.key = *key;
      rows.array.role = role;
      rows.array.shape = member.ShapeText();
      rows.array.type = TypeName(member.array);
      rows.values = member.AsDoubles();
      if (member.array.shape.empty() || rows.values.empty()) {
        motion_.problems.push_back(
            fmt::format("{} has shape {}, no frames", *key, rows.array.shape));
        return;
      }
      // (3,) is one frame.
      const std::size_t frames = member.array.shape.size() == 1 ? 1 : member.array.shape[0];
      rows.array.frames = static_cast<int>(std::min(frames, kMaxLooseFrames));
      rows.width = rows.values.size() / frames;
      for (std::size_t i = 0; i < rows.values.size(); ++i) {
        if (std::abs(rows.values[i]) <= kMaxMeters) continue;
        if (rows.array.out_of_range++ == 0) {
          rows.array.first_out_of_range = static_cast<int>(i / rows.width);
        }
        rows.values[i] = 0.0;
      }
      found = std::move(rows);
    });
    return found;
  }

  void Keep(Rows rows) {
    lengths_.push_back(rows.array.frames);
    motion_.arrays.push_back(std::move(rows.array));
  }

  // Rotations of `joints` joints; nothing for another width (kept as coefficients).
  std::optional<Rows> FindRotations(std::initializer_list<const char*> keys, const char* role,
                                    std::size_t joints) {
    auto rows = Find(keys, role);
    if (!rows) return std::nullopt;
    const auto form = FormOf(rows->width, joints);
    rows->array.form = form.value_or(RotationForm::kCoefficients);
    if (form == RotationForm::kMatrix) {
      for (std::size_t i = 0; i + 9 <= rows->values.size(); i += 9) {
        const Eigen::Matrix3d R = Rotation(rows->values.data() + i, *form);
        rows->array.orthonormality_off =
            std::max(rows->array.orthonormality_off,
                     (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff());
      }
    }
    if (!form) {
      Keep(std::move(*rows));
      return std::nullopt;
    }
    return rows;
  }

  // Copies parts (from, to, count) of an array of `joints` joints: joints [from, from + count) into
  // joints [to, ...).
  bool Joints(std::initializer_list<const char*> keys, const char* role, std::size_t joints,
              std::initializer_list<std::array<int, 3>> parts) {
    auto found = FindRotations(keys, role, joints);
    if (!found) return false;
    const RotationForm form = found->array.form;
    const auto numbers = static_cast<std::ptrdiff_t>(found->width / joints);
    const auto frames = static_cast<std::size_t>(found->array.frames);
    if (motion_.pose.size() < frames) motion_.pose.resize(frames, JointPose::Zero());
    for (std::size_t t = 0; t < frames; ++t) {
      const double* row = found->values.data() + t * found->width;
      for (const auto& [from, to, count] : parts) {
        for (int k = 0; k < count; ++k) {
          const double* p = row + numbers * (from + k);
          motion_.pose[t].col(to + k) = form == RotationForm::kAxisAngle
                                            ? Eigen::Vector3d(p[0], p[1], p[2])
                                            : LogSO3(NearestRotation(Rotation(p, form)));
        }
      }
    }
    Keep(std::move(*found));
    return true;
  }

  bool Points(std::initializer_list<const char*> keys, const char* role, Eigen::Matrix3Xd& out) {
    auto rows = Find(keys, role);
    if (!rows) return false;
    if (rows->width != 3) {
      motion_.problems.push_back(fmt::format("{} has shape {} where (N, 3) is needed",
                                             rows->array.key, rows->array.shape));
      return false;
    }
    out = Eigen::Map<const Eigen::Matrix3Xd>(rows->values.data(), 3, rows->array.frames);
    Keep(std::move(*rows));
    return true;
  }

  void Object() {
    motion_.has_object = Points({"object_trans", "object_transl", "obj_trans", "obj_transl"},
                                "object position", motion_.object_trans);
    auto found = FindRotations({"object_orient", "object_global_orient", "obj_rot", "object_rot",
                                "obj_orient", "object_pose", "object_rotation"},
                               "object rotation", 1);
    if (!found) {
      motion_.has_object = false;
      return;
    }
    const RotationForm form = found->array.form;
    for (int t = 0; t < found->array.frames; ++t) {
      const Eigen::Matrix3d R =
          Rotation(found->values.data() + static_cast<std::size_t>(t) * found->width, form);
      motion_.object_rotation.push_back(form == RotationForm::kMatrix ? NearestRotation(R) : R);
    }
    Keep(std::move(*found));
  }

  double Number(std::initializer_list<const char*> keys) {
    std::optional<double> number;
    for (const char* key : keys) {
      if (number) break;
      Try(key, [&](const NpyMember& member) {
        const std::vector<double> values = member.AsDoubles();
        if (values.size() == 1) {
          number = values[0];
        } else {
          motion_.problems.push_back(fmt::format("{} is not one number", key));
        }
      });
    }
    return number.value_or(0.0);
  }

  void Texts(std::initializer_list<const char*> keys) {
    for (const char* key : keys) {
      Try(key, [&](const NpyMember& member) { motion_.texts[key] = member.AsText(); });
    }
  }

  // Numbers per frame of the first present array; 0 if there is none.
  std::size_t Width(std::initializer_list<const char*> keys) {
    std::optional<std::size_t> width;
    for (const char* key : keys) {
      if (width) break;
      Try(key, [&](const NpyMember& member) {
        const std::vector<std::size_t>& shape = member.array.shape;
        width = shape.empty() || shape[0] == 0
                    ? 0
                    : member.array.NumElements() / (shape.size() == 1 ? 1 : shape[0]);
      });
    }
    return width.value_or(0);
  }

  // Truncates all arrays to the shortest length.
  void Cut() {
    if (lengths_.empty()) return;
    const auto [low, high] = std::ranges::minmax_element(lengths_);
    motion_.lengths_differ = *low != *high;
    motion_.frames = *low;
    motion_.pose.resize(static_cast<std::size_t>(motion_.frames), JointPose::Zero());
    if (motion_.has_trans) {
      motion_.trans = motion_.trans.leftCols(motion_.frames).eval();
    } else {
      motion_.trans.setZero(3, motion_.frames);
    }
    if (motion_.has_object) {
      motion_.object_trans = motion_.object_trans.leftCols(motion_.frames).eval();
      motion_.object_rotation.resize(static_cast<std::size_t>(motion_.frames));
    }
  }

 private:
  const NpzReader& archive_;
  LooseMotion& motion_;
  std::vector<int> lengths_;
};

}  // namespace

std::string_view Describe(RotationForm form) {
  constexpr std::array<std::string_view, 5> kNames = {"axis-angle", "matrices", "quaternions", "6D",
                                                      "coefficients"};
  return kNames[static_cast<std::size_t>(form)];
}

LooseMotion LooseMotionOf(const Clip& clip) {
  LooseMotion motion;
  motion.frame_rate = clip.frame_rate;
  motion.frames = clip.NumFrames();
  // Readers put zeros where a file has no translation: they tell nothing of a floor.
  motion.has_trans = !clip.trans.isZero(0.0);
  motion.has_root = motion.has_body = motion.has_hands = true;
  motion.num_joints = kNumJoints;
  motion.trans = clip.trans;
  motion.pose = clip.pose;
  motion.has_object = clip.object.has_value();
  if (clip.object) {
    motion.object_trans = clip.object->trans;
    for (int t = 0; t < motion.frames; ++t) {
      motion.object_rotation.push_back(ExpSO3(clip.object->orient.col(t)));
    }
  }
  motion.holding_hand.assign(clip.holding_hand.begin(), clip.holding_hand.end());
  motion.num_betas = static_cast<int>(clip.betas.size());
  motion.texts["surface_model_type"] = clip.surface_model_type;
  return motion;
}

LooseMotion ReadLooseMotion(const NpzReader& archive) {
  LooseMotion motion;
  Reader read(archive, motion);
  motion.frame_rate = read.Number({"mocap_frame_rate", "mocap_framerate", "framerate", "fps"});
  if (!(motion.frame_rate >= kLowestFrameRate && motion.frame_rate <= kHighestFrameRate)) {
    motion.frame_rate = 0.0;  // ReadClip reports the reason
  }
  motion.has_trans = read.Points({"trans", "transl"}, "root position", motion.trans);
  try {
    if (motion.has_trans) motion.trans.colwise() += PelvisOffset(archive);
  } catch (const Error&) {  // ReadClip reports the reason
  }

  // One array for all joints, or one per part. SMPL-H has no jaw and eyes, SMPL no fingers.
  const std::size_t width = read.Width({"poses", "fullpose"});
  if (FormOf(width, kNumJoints)) {
    motion.num_joints = kNumJoints;
    read.Joints({"poses", "fullpose"}, "all joints", kNumJoints, {{0, 0, kNumJoints}});
  } else if (FormOf(width, kSmplhJoints)) {
    motion.num_joints = kSmplhJoints;
    read.Joints({"poses", "fullpose"}, "all joints", kSmplhJoints,
                {{0, 0, kNumBodyJoints}, {kNumBodyJoints, kLeftHandBegin, 2 * kJointsPerHand}});
  } else if (FormOf(width, kSmplJoints)) {
    motion.num_joints = kSmplJoints;
    read.Joints({"poses", "fullpose"}, "all joints", kSmplJoints, {{0, 0, kNumBodyJoints}});
  }
  motion.has_root = motion.has_body = motion.num_joints > 0;
  motion.has_hands = motion.num_joints >= kSmplhJoints;
  if (motion.num_joints == 0) {
    motion.has_root = read.Joints({"root_orient", "global_orient"}, "root", 1, {{0, 0, 1}});
    motion.has_body = read.Joints({"pose_body", "body_pose"}, "body", 21, {{0, 1, 21}});
    read.Joints({"pose_jaw", "jaw_pose"}, "jaw", 1, {{0, 22, 1}});
    read.Joints({"pose_eye"}, "eyes", 2, {{0, 23, 2}});
    read.Joints({"leye_pose"}, "left eye", 1, {{0, 23, 1}});
    read.Joints({"reye_pose"}, "right eye", 1, {{0, 24, 1}});
    motion.has_hands = read.Joints({"pose_hand"}, "both hands", 30, {{0, kLeftHandBegin, 30}}) ||
                       (static_cast<int>(read.Joints({"left_hand_pose"}, "left hand", 15,
                                                     {{0, kLeftHandBegin, 15}})) &
                        static_cast<int>(read.Joints({"right_hand_pose"}, "right hand", 15,
                                                     {{0, kRightHandBegin, 15}})));
  }
  read.Object();
  read.Texts({"gender", "surface_model_type", "body_model", "object_name", "object_mesh"});
  read.Try("betas", [&](const NpyMember& member) {
    const NpyArray& betas = member.array;
    motion.num_betas =
        static_cast<int>(betas.shape.size() > 1 ? betas.shape.back() : betas.NumElements());
  });
  read.Try("holding_hand", [&](const NpyMember& member) {
    for (const std::int64_t bits : member.AsIntegers()) {
      motion.holding_hand.push_back(static_cast<int>(bits & 3));
    }
  });
  read.Cut();
  return motion;
}

}  // namespace holdfast
