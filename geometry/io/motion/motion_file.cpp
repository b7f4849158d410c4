// SPDX-License-Identifier: MIT
#include "geometry/io/motion/motion_file.h"

#include <map>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/options.h"

namespace holdfast {

void CheckMemoryBudget(const TextScanner& scanner, double frames, int joints,
                       std::size_t text_bytes) {
  constexpr double kAlwaysBytes = 60 << 20;
  constexpr double kJointFrameBytes = 56;  // a rotation and a position
  const double joint_frames = frames * joints;
  if (joint_frames > kMaxJointFrames) {
    scanner.Fail(fmt::format("{} frames of {} joints exceed the limit", frames, joints),
                 "Cut the motion into parts");
  }
  if (joint_frames * kJointFrameBytes > 10 * static_cast<double>(text_bytes) + kAlwaysBytes) {
    scanner.Fail(fmt::format("{} frames of {} joints, most of which never move, would take too "
                             "much memory for {} bytes of text",
                             frames, joints, text_bytes),
                 "Remove the joints without channels, or cut the motion into parts");
  }
}

void RequireInRange(const SourceMotion& motion, std::string_view where) {
  RequireFrameRate(motion.frame_rate, where);
  const std::string remedy =
      fmt::format("{} (set the unit with import --meters-per-unit)", kMetersRemedy);
  const auto require = [&](const auto& positions, std::string_view field, std::string_view column) {
    RequireWithin(positions, kMaxMeters, where, field, column, remedy);
  };
  require(motion.rest_offsets, "offsets", "joint");
  for (std::size_t t = 0; t < motion.positions.size(); ++t) {
    require(motion.positions[t], fmt::format("frame {}", t), "joint");
  }
  for (std::size_t i = 0; i < motion.rotations.size(); ++i) {
    if (motion.rotations[i].coeffs().allFinite()) continue;
    throw Error(
        where, fmt::format("a rotation of frame {} is not a number", i / motion.joint_names.size()),
        "Cut such frames out, or export it again");
  }
  if (!motion.prop) return;
  require(motion.prop->positions, motion.prop->name, "frame");
  RequireInRange(motion.prop->mesh, where);
}

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Joints of all poses as (T x 3 count).
RowMajor Joints(const Clip& clip, int begin, int count) {
  RowMajor values(clip.NumFrames(), 3 * count);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    values.row(t) = clip.pose[t].middleCols(begin, count).reshaped();
  }
  return values;
}

std::map<std::string, RowMajor> PackageArrays(const Clip& clip, ModelKind kind) {
  std::map<std::string, RowMajor> arrays;
  arrays["global_orient"] = Joints(clip, 0, 1);
  arrays["transl"] = clip.trans.transpose();
  arrays["betas"] = WrittenBetas(clip).transpose();
  if (const std::optional<Side> hand = LoneHand(kind)) {
    arrays["hand_pose"] = Joints(clip, HandBegin(*hand), kJointsPerHand);
    return arrays;
  }
  arrays["body_pose"] = Joints(clip, 1, kNumBodyJoints - 1);
  arrays["left_hand_pose"] = Joints(clip, kLeftHandBegin, kJointsPerHand);
  arrays["right_hand_pose"] = Joints(clip, kRightHandBegin, kJointsPerHand);
  if (kind == ModelKind::kSmplx) {
    arrays["jaw_pose"] = Joints(clip, 22, 1);
    arrays["leye_pose"] = Joints(clip, 23, 1);
    arrays["reye_pose"] = Joints(clip, 24, 1);
  }
  return arrays;
}

std::string PackageName(ModelKind kind) {
  return LoneHand(kind) ? "mano" : std::string(ModelKindName(kind));
}

void Add(NpzWriter& writer, const std::string& key, const RowMajor& values) {
  writer.AddFloat64(
      key, {static_cast<std::size_t>(values.rows()), static_cast<std::size_t>(values.cols())},
      {values.data(), values.data() + values.size()});
}

void WritePackageNpz(const Clip& clip, ModelKind kind, bool flat_hand_mean,
                     const std::filesystem::path& path) {
  NpzWriter writer;
  for (const auto& [key, values] : PackageArrays(clip, kind)) Add(writer, key, values);
  writer.AddUint8("flat_hand_mean", {}, {static_cast<std::uint8_t>(flat_hand_mean)});
  writer.AddText("model_type", PackageName(kind));
  writer.AddText("gender", clip.gender);
  writer.AddFloat64("fps", {}, {clip.frame_rate});
  if (const std::optional<Side> hand = LoneHand(kind)) {
    writer.AddUint8("is_rhand", {}, {static_cast<std::uint8_t>(*hand == Side::kRight)});
  }
  writer.Write(path);
}

void WritePackageJson(const Clip& clip, ModelKind kind, bool flat_hand_mean,
                      const std::filesystem::path& path) {
  nlohmann::json root = {{"flat_hand_mean", flat_hand_mean},
                         {"model_type", PackageName(kind)},
                         {"gender", clip.gender},
                         {"fps", clip.frame_rate}};
  if (const std::optional<Side> hand = LoneHand(kind)) root["is_rhand"] = *hand == Side::kRight;
  for (const auto& [key, values] : PackageArrays(clip, kind)) {
    nlohmann::json rows = nlohmann::json::array();
    for (Eigen::Index r = 0; r < values.rows(); ++r) {
      rows.push_back(std::vector<double>(values.row(r).begin(), values.row(r).end()));
    }
    root[key] = std::move(rows);
  }
  WriteAtomically(path, JsonText(root) + "\n");
}

// AMASS's SMPL-H files have all 52 joints in one array.
void WriteAmassSmplh(const Clip& clip, const std::filesystem::path& path) {
  RowMajor poses(clip.NumFrames(), 156);
  poses << Joints(clip, 0, kNumBodyJoints), Joints(clip, kLeftHandBegin, 2 * kJointsPerHand);
  NpzWriter writer;
  Add(writer, "poses", poses);
  Add(writer, "trans", clip.trans.transpose());
  const Eigen::VectorXd betas = WrittenBetas(clip);
  writer.AddFloat64("betas", {static_cast<std::size_t>(betas.size())},
                    {betas.begin(), betas.end()});
  writer.AddText("gender", clip.gender);
  writer.AddFloat64("mocap_framerate", {}, {clip.frame_rate});
  writer.Write(path);
}

}  // namespace

void WriteParameters(const Clip& clip, ModelKind kind, ParameterLayout layout, bool flat_hand_mean,
                     const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  const bool json = extension == ".json";
  if (!json && extension != ".npz") {
    throw Error(path.string(), "is not a supported parameter format",
                "Give a name in .npz or .json");
  }
  if (layout == ParameterLayout::kAmass) {
    if (json) {
      throw Error(path.string(), "AMASS's files are .npz",
                  "Give a name in .npz, or another layout");
    }
    if (kind == ModelKind::kSmplh) return WriteAmassSmplh(clip, path);
    return WriteClip(clip, path);
  }
  if (json) return WritePackageJson(clip, kind, flat_hand_mean, path);
  WritePackageNpz(clip, kind, flat_hand_mean, path);
}

}  // namespace holdfast
