// SPDX-License-Identifier: MIT
#include "geometry/clip.h"

#include <cmath>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/npz.h"

namespace holdfast {
namespace {

// Reads (T, columns) as columns x T doubles, all finite.
Eigen::MatrixXd ReadRows(const NpzReader& archive, std::string_view key, std::ptrdiff_t columns) {
  const NpyMember member = archive.Read(key);
  member.RequireShape({-1, columns});
  const std::vector<double> values = member.AsDoubles();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw Error(
          member.where,
          fmt::format("holds {} in frame {}", values[i], i / static_cast<std::size_t>(columns)),
          "Cut these frames out or fill them in");
    }
  }
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), columns,
                                           static_cast<Eigen::Index>(member.array.shape[0]));
}

void RequireLength(const NpzReader& archive, std::string_view key, Eigen::Index found,
                   Eigen::Index frames) {
  if (found == frames) return;
  throw Error(fmt::format("{}[{}]", archive.Path().string(), key),
              fmt::format("has {} frames where trans has {}", found, frames),
              "All motion arrays of a clip have the same length");
}

std::string ReadText(const NpzReader& archive, std::string_view key, std::string fallback) {
  return archive.Has(key) ? archive.Read(key).AsText() : std::move(fallback);
}

double ReadFrameRate(const NpzReader& archive) {
  // AMASS spells it without the underscore in its SMPL-H archives.
  const bool old_spelling = !archive.Has("mocap_frame_rate") && archive.Has("mocap_framerate");
  const NpyMember member = archive.Read(old_spelling ? "mocap_framerate" : "mocap_frame_rate");
  const std::vector<double> values = member.AsDoubles();
  if (values.size() != 1 || !(values[0] > 0.0) || !std::isfinite(values[0])) {
    throw Error(member.where,
                fmt::format("is not one positive number (shape {}{})", member.ShapeText(),
                            values.size() == 1 ? fmt::format(", {}", values[0]) : ""),
                "Give the frames per second");
  }
  return values[0];
}

// Copies `part` (3k x T) into joints [begin, begin + k) of each pose.
void SetJoints(std::vector<JointPose>& pose, int begin, const Eigen::MatrixXd& part) {
  for (std::size_t t = 0; t < pose.size(); ++t) {
    pose[t].middleCols(begin, part.rows() / 3) =
        part.col(static_cast<Eigen::Index>(t)).reshaped(3, part.rows() / 3);
  }
}

}  // namespace

Clip ReadClip(const std::filesystem::path& path) { return ReadClip(NpzReader(path)); }

Clip ReadClip(const NpzReader& archive) {
  Clip clip;
  clip.frame_rate = ReadFrameRate(archive);
  clip.trans = ReadRows(archive, "trans", 3);
  const Eigen::Index frames = clip.trans.cols();
  if (frames == 0) {
    throw Error(archive.Path().string(), "has no frames", "Give a clip of at least one frame");
  }
  clip.pose.assign(static_cast<std::size_t>(frames), JointPose::Zero());
  const auto read_joints = [&](std::string_view key, int begin, int count) {
    const Eigen::MatrixXd part = ReadRows(archive, key, 3 * count);
    RequireLength(archive, key, part.cols(), frames);
    SetJoints(clip.pose, begin, part);
  };
  if (!archive.Has("root_orient") && archive.Has("poses")) {
    read_joints("poses", 0, kNumJoints);
  } else {
    read_joints("root_orient", 0, 1);
    read_joints("pose_body", 1, 21);
    if (archive.Has("pose_jaw")) read_joints("pose_jaw", 22, 1);
    if (archive.Has("pose_eye")) read_joints("pose_eye", 23, 2);
    if (archive.Has("pose_hand")) read_joints("pose_hand", kLeftHandBegin, 2 * kJointsPerHand);
  }
  if (archive.Has("betas")) {
    const NpyMember member = archive.Read("betas");
    const std::vector<double> values = member.AsDoubles();
    for (const double value : values) {
      if (!std::isfinite(value)) throw Error(member.where, "holds NaN", "Give finite betas");
    }
    clip.betas =
        Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  }
  clip.gender = ReadText(archive, "gender", "neutral");
  clip.surface_model_type = ReadText(archive, "surface_model_type", "smplx");
  clip.body_model = ReadText(archive, "body_model", "");
  if (archive.Has("object_trans") || archive.Has("object_orient")) {
    ObjectTrack object;
    object.trans = ReadRows(archive, "object_trans", 3);
    object.orient = ReadRows(archive, "object_orient", 3);
    RequireLength(archive, "object_trans", object.trans.cols(), frames);
    RequireLength(archive, "object_orient", object.orient.cols(), frames);
    object.name = ReadText(archive, "object_name", "");
    object.mesh = ReadText(archive, "object_mesh", "");
    clip.object = std::move(object);
  }
  if (archive.Has("holding_hand")) {
    const NpyMember member = archive.Read("holding_hand");
    member.RequireShape({static_cast<std::ptrdiff_t>(frames)});
    for (const std::int64_t bits : member.AsIntegers()) {
      if (bits < 0 || bits > (kHoldsRight | kHoldsLeft)) {
        throw Error(member.where, fmt::format("holds {}", bits),
                    "0 is neither hand, 1 right, 2 left, 3 both");
      }
      clip.holding_hand.push_back(static_cast<std::uint8_t>(bits));
    }
  }
  return clip;
}

void WriteClip(const Clip& clip, const std::filesystem::path& path) {
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  NpzWriter writer;
  const auto add_rows = [&](const char* key, std::size_t columns, const Eigen::MatrixXd& values) {
    writer.AddFloat64(key, {frames, columns}, {values.data(), values.data() + values.size()});
  };
  const auto add_joints = [&](const char* key, int begin, int count) {
    Eigen::MatrixXd part(3 * count, clip.NumFrames());
    for (int t = 0; t < clip.NumFrames(); ++t) {
      part.col(t) = clip.pose[static_cast<std::size_t>(t)].middleCols(begin, count).reshaped();
    }
    add_rows(key, static_cast<std::size_t>(3 * count), part);
  };
  writer.AddFloat64("mocap_frame_rate", {}, {clip.frame_rate});
  add_rows("trans", 3, clip.trans);
  add_joints("root_orient", 0, 1);
  add_joints("pose_body", 1, 21);
  add_joints("pose_jaw", 22, 1);
  add_joints("pose_eye", 23, 2);
  add_joints("pose_hand", kLeftHandBegin, 2 * kJointsPerHand);
  writer.AddFloat64("betas", {static_cast<std::size_t>(clip.betas.size())},
                    {clip.betas.data(), clip.betas.data() + clip.betas.size()});
  writer.AddText("gender", clip.gender);
  writer.AddText("surface_model_type", clip.surface_model_type);
  if (!clip.body_model.empty()) writer.AddText("body_model", clip.body_model);
  if (clip.object) {
    add_rows("object_trans", 3, clip.object->trans);
    add_rows("object_orient", 3, clip.object->orient);
    writer.AddText("object_name", clip.object->name);
    writer.AddText("object_mesh", clip.object->mesh);
  }
  if (!clip.holding_hand.empty()) writer.AddUint8("holding_hand", {frames}, clip.holding_hand);
  writer.Write(path);
}

Clip Slice(const Clip& clip, int begin, int end) {
  Clip part = clip;
  part.trans = clip.trans.middleCols(begin, end - begin);
  part.pose.assign(clip.pose.begin() + begin, clip.pose.begin() + end);
  if (clip.object) {
    part.object->trans = clip.object->trans.middleCols(begin, end - begin);
    part.object->orient = clip.object->orient.middleCols(begin, end - begin);
  }
  if (!clip.holding_hand.empty()) {
    part.holding_hand.assign(clip.holding_hand.begin() + begin, clip.holding_hand.begin() + end);
  }
  return part;
}

}  // namespace holdfast
