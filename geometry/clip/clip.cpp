// SPDX-License-Identifier: MIT
#include "geometry/clip/clip.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <numbers>
#include <numeric>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/options.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr const char* kObjectChecksum = "object_checksum";

// Arrays of a clip's file: those of AMASS's SMPL-X layout, and Holdfast's own.
constexpr std::array kAmassArrays = {"mocap_frame_rate",
                                     "mocap_framerate",
                                     "mocap_time_length",
                                     "trans",
                                     "root_orient",
                                     "pose_body",
                                     "pose_jaw",
                                     "pose_eye",
                                     "pose_hand",
                                     "poses",
                                     "betas",
                                     "num_betas",
                                     "gender",
                                     "surface_model_type"};
constexpr std::array kOwnArrays = {"body_model",     "subject",      "action",       "object_trans",
                                   "object_orient",  "object_name",  "object_mesh",  "table_trans",
                                   "table_orient",   "table_name",   "table_mesh",   "v_template",
                                   "contact_object", "contact_body", "holding_hand", "rest_pelvis",
                                   kObjectChecksum};

bool HasAll(std::span<const std::string> names, std::initializer_list<const char*> wanted) {
  return std::ranges::all_of(
      wanted, [&](const char* name) { return std::ranges::find(names, name) != names.end(); });
}

// Reads (T, columns) as columns x T doubles, all finite.
Eigen::MatrixXd ReadRows(const NpzReader& archive, std::string_view key, std::ptrdiff_t columns,
                         std::string_view row_is = "frame") {
  const NpyMember member = archive.Read(key);
  member.RequireShape({-1, columns});
  const std::vector<double> values = member.AsDoubles();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw Error(member.where,
                  fmt::format("holds {} in {} {}", values[i], row_is,
                              i / static_cast<std::size_t>(columns)),
                  "Give finite numbers: cut such frames out or fill them in");
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

// Reads the track whose arrays begin with `prefix`; nothing if the archive has none.
std::optional<ObjectTrack> ReadTrack(const NpzReader& archive, const std::string& prefix,
                                     Eigen::Index frames) {
  const std::string trans = prefix + "_trans";
  const std::string orient = prefix + "_orient";
  if (!archive.Has(trans) && !archive.Has(orient)) return std::nullopt;
  ObjectTrack track;
  track.trans = ReadRows(archive, trans, 3);
  track.orient = ReadRows(archive, orient, 3);
  RequireLength(archive, trans, track.trans.cols(), frames);
  RequireLength(archive, orient, track.orient.cols(), frames);
  track.name = ReadText(archive, prefix + "_name", "");
  track.mesh = ReadText(archive, prefix + "_mesh", "");
  return track;
}

// Labels (T, V) as V x T; empty if the archive has none.
ContactLabels::Matrix ReadLabels(const NpzReader& archive, std::string_view key,
                                 Eigen::Index frames) {
  if (!archive.Has(key)) return {};
  const NpyMember member = archive.Read(key);
  member.RequireShape({static_cast<std::ptrdiff_t>(frames), -1});
  const std::vector<std::int64_t> values = member.AsIntegers();
  ContactLabels::Matrix labels(static_cast<Eigen::Index>(member.array.shape[1]), frames);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] < 0 || values[i] > 255) {
      throw Error(member.where, fmt::format("holds {}", values[i]), "Labels are 0 to 255");
    }
    labels(static_cast<Eigen::Index>(i)) = static_cast<std::uint8_t>(values[i]);
  }
  return labels;
}

}  // namespace

Eigen::Isometry3d ObjectTrack::Pose(Eigen::Index frame) const {
  return RigidTransform(ExpSO3(orient.col(frame)), trans.col(frame));
}

void ObjectTrack::SetPose(Eigen::Index frame, const Eigen::Isometry3d& world_from_object) {
  trans.col(frame) = world_from_object.translation();
  orient.col(frame) = UnwrapAxisAngle(LogSO3(world_from_object.linear()),
                                      orient.col(std::max<Eigen::Index>(frame - 1, 0)));
}

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
    for (std::size_t t = 0; t < clip.pose.size(); ++t) {
      clip.pose[t].middleCols(begin, count) =
          part.col(static_cast<Eigen::Index>(t)).reshaped(3, count);
    }
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
    const std::vector<std::size_t>& shape = member.array.shape;
    if (shape.size() > 2 || (shape.size() == 2 && shape[0] > 1)) {
      throw Error(
          member.where,
          fmt::format("has shape {}, but a clip has a single body shape", member.ShapeText()),
          "Convert it with 'holdfast import', which averages betas over the frames");
    }
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
  clip.subject = ReadText(archive, "subject", "");
  clip.action = ReadText(archive, "action", "");
  clip.object = ReadTrack(archive, "object", frames);
  clip.table = ReadTrack(archive, "table", frames);
  if (archive.Has("v_template")) clip.v_template = ReadRows(archive, "v_template", 3, "vertex");
  if (archive.Has("contact_object") || archive.Has("contact_body")) {
    clip.contact = ContactLabels{ReadLabels(archive, "contact_object", frames),
                                 ReadLabels(archive, "contact_body", frames)};
  }
  if (archive.Has("holding_hand")) {
    clip.holding_hand = HoldingHandOf(archive.Read("holding_hand"), frames);
  }
  const Eigen::Vector3d offset = PelvisOffset(archive);
  if (!offset.isZero(0.0)) clip.trans.colwise() += offset;
  RequireInRange(clip, archive.Path().string());
  return clip;
}

Eigen::Vector3d PelvisOffset(const NpzReader& archive) {
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  if (ReadText(archive, "body_model", "") != BodyModel::kDefaultName) return none;
  if (archive.Has("v_template")) return none;
  Eigen::Vector3d pelvis = none;
  if (archive.Has("rest_pelvis")) {
    const NpyMember member = archive.Read("rest_pelvis");
    member.RequireShape({3});
    pelvis = Eigen::Vector3d(member.AsDoubles().data());
    RequireWithin(pelvis, kMaxMeters, archive.Path().string(), "rest_pelvis", "row", kMetersRemedy);
  }
  return pelvis == kEmbeddedRestPelvis ? none : Eigen::Vector3d(pelvis - kEmbeddedRestPelvis);
}

std::optional<std::string> OldPelvisNote(const NpzReader& archive) {
  const Eigen::Vector3d offset = PelvisOffset(archive);
  if (offset.isZero(0.0)) return std::nullopt;
  return fmt::format(
      "made with an earlier {}, whose rest pelvis was at another position: trans is moved by "
      "({:.3f}, {:.3f}, {:.3f}) m to keep the body in place",
      BodyModel::kDefaultName, offset.x(), offset.y(), offset.z());
}

bool IsHoldfastClip(std::span<const std::string> names) {
  return HasAll(names, {"trans"}) &&
         (HasAll(names, {"root_orient", "pose_body"}) || HasAll(names, {"poses"})) &&
         (HasAll(names, {"body_model"}) || HasAll(names, {"object_trans"}) ||
          HasAll(names, {"object_orient"}) || HasAll(names, {"holding_hand"}));
}

bool HasOnlyClipArrays(std::span<const std::string> names) {
  const auto known = [](const std::string& name) {
    return std::ranges::find(kAmassArrays, name) != kAmassArrays.end() ||
           std::ranges::find(kOwnArrays, name) != kOwnArrays.end();
  };
  const bool only_joined = HasAll(names, {"poses"}) && !HasAll(names, {"root_orient"});
  return !only_joined && std::ranges::all_of(names, known);
}

Eigen::VectorXd WrittenBetas(const Clip& clip) {
  constexpr int kAmassBetas = 16;
  return clip.betas.size() > 0 ? clip.betas : Eigen::VectorXd(Eigen::VectorXd::Zero(kAmassBetas));
}

std::string WrapJointAngles(Clip& clip) {
  constexpr double kHalfTurn = std::numbers::pi * (1 + 1e-9);
  int frames = 0;
  int first_frame = -1, first_joint = -1;
  for (std::size_t t = 0; t < clip.pose.size(); ++t) {
    bool wrapped = false;
    for (int j = 1; j < kNumJoints; ++j) {
      if (clip.pose[t].col(j).norm() <= kHalfTurn) continue;
      clip.pose[t].col(j) = LogSO3(ExpSO3(clip.pose[t].col(j)));
      if (first_frame < 0) first_frame = static_cast<int>(t);
      if (first_joint < 0) first_joint = j;
      wrapped = true;
    }
    frames += wrapped;
  }
  if (frames == 0) return {};
  return fmt::format(
      "warning: joints rotate by more than half a turn in {} of {} frames (first {} in frame {}): "
      "replaced by the equal rotations within half a turn",
      frames, clip.pose.size(), kJointNames[static_cast<std::size_t>(first_joint)], first_frame);
}

void RoundToFloat(Clip& clip) {
  const auto round = [](auto& values) {
    values = values.template cast<float>().template cast<double>().eval();
  };
  round(clip.trans);
  for (JointPose& pose : clip.pose) round(pose);
  if (!clip.object) return;
  round(clip.object->trans);
  round(clip.object->orient);
}

void AddArrays(const Clip& clip, NpzWriter& writer) {
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  const auto add_rows = [&](const std::string& key, std::size_t columns,
                            const Eigen::MatrixXd& values) {
    writer.AddFloat64(key, {frames, columns}, {values.data(), values.data() + values.size()});
  };
  const auto add_joints = [&](const char* key, int begin, int count) {
    Eigen::MatrixXd part(3 * count, clip.NumFrames());
    for (int t = 0; t < clip.NumFrames(); ++t) {
      part.col(t) = clip.pose[static_cast<std::size_t>(t)].middleCols(begin, count).reshaped();
    }
    add_rows(key, static_cast<std::size_t>(3 * count), part);
  };
  // AMASS spells it in both ways.
  for (const char* name : {"mocap_frame_rate", "mocap_framerate"}) {
    writer.AddFloat64(name, {}, {clip.frame_rate});
  }
  add_rows("trans", 3, clip.trans);
  add_joints("root_orient", 0, 1);
  add_joints("pose_body", 1, 21);
  add_joints("pose_jaw", 22, 1);
  add_joints("pose_eye", 23, 2);
  add_joints("pose_hand", kLeftHandBegin, 2 * kJointsPerHand);
  // For AMASS's own loaders, which expect all joints in one array and a non-empty shape. Floats are
  // sufficient for a copy.
  std::vector<float> poses;
  for (const JointPose& pose : clip.pose) {
    std::ranges::transform(pose.reshaped(), std::back_inserter(poses),
                           [](double angle) { return static_cast<float>(angle); });
  }
  writer.AddFloat32("poses", {frames, 3 * kNumJoints}, std::move(poses));
  const Eigen::VectorXd betas = WrittenBetas(clip);
  writer.AddFloat64("betas", {static_cast<std::size_t>(betas.size())},
                    {betas.begin(), betas.end()});
  writer.AddInt64("num_betas", {}, {betas.size()});
  writer.AddFloat64("mocap_time_length", {}, {clip.NumFrames() / clip.frame_rate});
  writer.AddText("gender", clip.gender);
  writer.AddText("surface_model_type", clip.surface_model_type);
  if (!clip.body_model.empty()) writer.AddText("body_model", clip.body_model);
  if (clip.body_model == BodyModel::kDefaultName && clip.v_template.cols() == 0) {
    writer.AddFloat64("rest_pelvis", {3}, {kEmbeddedRestPelvis.begin(), kEmbeddedRestPelvis.end()});
  }
  if (!clip.subject.empty()) writer.AddText("subject", clip.subject);
  if (!clip.action.empty()) writer.AddText("action", clip.action);
  const auto add_track = [&](const std::string& prefix, const ObjectTrack& track) {
    add_rows(prefix + "_trans", 3, track.trans);
    add_rows(prefix + "_orient", 3, track.orient);
    writer.AddText(prefix + "_name", track.name);
    writer.AddText(prefix + "_mesh", track.mesh);
  };
  if (clip.object) add_track("object", *clip.object);
  if (clip.table) add_track("table", *clip.table);
  if (clip.v_template.cols() > 0) {
    writer.AddFloat64("v_template", {static_cast<std::size_t>(clip.v_template.cols()), 3},
                      {clip.v_template.data(), clip.v_template.data() + clip.v_template.size()});
  }
  const auto add_labels = [&](const char* key, const ContactLabels::Matrix& labels) {
    if (labels.size() == 0) return;
    writer.AddUint8(key, {frames, static_cast<std::size_t>(labels.rows())},
                    {labels.data(), labels.data() + labels.size()});
  };
  if (clip.contact) {
    add_labels("contact_object", clip.contact->object);
    add_labels("contact_body", clip.contact->body);
  }
  if (!clip.holding_hand.empty()) writer.AddUint8("holding_hand", {frames}, clip.holding_hand);
}

void WriteClip(const Clip& clip, const std::filesystem::path& path) {
  NpzWriter writer;
  AddArrays(clip, writer);
  writer.Write(path);
}

void WriteClip(const Clip& clip, const TriangleMesh& object, const std::filesystem::path& path) {
  NpzWriter writer;
  AddArrays(clip, writer);
  if (clip.object) writer.AddText(kObjectChecksum, MeshChecksum(object));
  writer.Write(path);
}

void WriteClipFiles(Clip clip, const TriangleMesh& object, const std::filesystem::path& folder) {
  if (clip.object) clip.object->mesh = "object.ply";
  WriteMesh(object, folder / "object.ply");
  if (const TriangleMesh* table = TableMesh(clip)) {
    clip.table->mesh = "table.ply";
    WriteMesh(*table, folder / clip.table->mesh);
  }
  WriteClip(clip, object, folder / "clip.npz");
}

std::string MeshChecksum(const TriangleMesh& mesh) {
  std::string bytes;  // little-endian on every machine
  bytes.reserve(4 * static_cast<std::size_t>(mesh.vertices.size() + mesh.faces.size()) + 4);
  const auto add = [&](std::uint32_t word) {
    for (int k = 0; k < 4; ++k) bytes += static_cast<char>(word >> (8 * k) & 0xff);
  };
  add(static_cast<std::uint32_t>(mesh.NumVertices()));
  for (const double x : mesh.vertices.reshaped()) {
    add(std::bit_cast<std::uint32_t>(static_cast<float>(x) + 0.0f));  // -0 is 0
  }
  for (const int id : mesh.faces.reshaped()) add(static_cast<std::uint32_t>(id));
  return Checksum(bytes);
}

std::vector<std::uint8_t> HoldingHandOf(const NpyMember& member, Eigen::Index frames) {
  member.RequireShape({static_cast<std::ptrdiff_t>(frames)});
  std::vector<std::uint8_t> hands;
  for (const std::int64_t bits : member.AsIntegers()) {
    if (bits < 0 || bits > (kHoldsRight | kHoldsLeft)) {
      throw Error(member.where, fmt::format("holds {}", bits),
                  "Use 0 (neither hand), 1 (right), 2 (left) or 3 (both)");
    }
    hands.push_back(static_cast<std::uint8_t>(bits));
  }
  return hands;
}

std::string MeshChecksumIn(const std::filesystem::path& clip) {
  std::array<char, 2> head{};
  std::ifstream file(clip, std::ios::binary);
  const bool is_npz = file.read(head.data(), head.size()) && head == std::array{'P', 'K'};
  return is_npz ? ReadText(NpzReader(clip), kObjectChecksum, "") : std::string();
}

void RequireMeshOf(const std::filesystem::path& clip, const TriangleMesh& mesh,
                   const std::string& source) {
  const std::string checksum = MeshChecksumIn(clip);
  if (checksum.empty() || checksum == MeshChecksum(mesh)) return;
  throw Error(source,
              fmt::format("is not the mesh that {} was made with: its vertices or faces differ",
                          clip.string()),
              kMeshRemedy);
}

Clip Slice(const Clip& clip, int begin, int end) {
  std::vector<int> frames(static_cast<std::size_t>(end - begin));
  std::iota(frames.begin(), frames.end(), begin);
  return TakeFrames(clip, frames);
}

void RequireInRange(const Clip& clip, std::string_view where) {
  RequireFrameRate(clip.frame_rate, where);
  RequireWithin(clip.trans, kMaxMeters, where, "trans", "frame", kMetersRemedy);
  for (std::size_t t = 0; t < clip.pose.size(); ++t) {
    for (Eigen::Index j = 0; j < clip.pose[t].cols(); ++j) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double angle = clip.pose[t](k, j);
        if (IsWithin(angle, kMaxRadians)) continue;
        throw Error(where,
                    fmt::format("rotates {} by {:g} rad in frame {}", kJointNames[j], angle, t),
                    kRadiansRemedy);
      }
    }
  }
  RequireWithin(clip.betas.transpose(), kMaxBeta, where, "betas", "coefficient",
                "Shape coefficients are standard deviations, within 1,000");
  RequireWithin(clip.v_template, kMaxMeters, where, "v_template", "vertex", kMetersRemedy);
  const auto require_track = [&](const std::optional<ObjectTrack>& track, std::string_view name) {
    if (!track) return;
    RequireWithin(track->trans, kMaxMeters, where, fmt::format("{}_trans", name), "frame",
                  kMetersRemedy);
    RequireWithin(track->orient, kMaxRadians, where, fmt::format("{}_orient", name), "frame",
                  kRadiansRemedy);
  };
  require_track(clip.object, "object");
  require_track(clip.table, "table");
}

}  // namespace holdfast
