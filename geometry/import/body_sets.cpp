// SPDX-License-Identifier: MIT
#include "geometry/import/body_sets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "geometry/body/body_kinematics.h"
#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

bool IsSequence(const Fields& fields) {
  return fields.Has("obj_rot") && fields.Has("obj_trans") && fields.Has("pose_body") &&
         fields.Has("seq_name");
}

// "sub3_largebox_003": largebox.
std::string ObjectOfSequence(const std::string& name) {
  const std::size_t begin = name.find('_'), end = name.rfind('_');
  return begin == end ? std::string() : name.substr(begin + 1, end - begin - 1);
}

void ReadOmomosObject(const Fields& sequence, const std::filesystem::path& path,
                      const ParameterOptions& options, ImportedClip& imported) {
  const Eigen::Index frames = imported.clip.trans.cols();
  ObjectTrack& track = imported.clip.object.emplace();
  track.name = ObjectOfSequence(TextOf(sequence, "seq_name"));
  track.orient = ReadObjectRotations(sequence["obj_rot"], imported, frames);
  track.trans = ReadFrameRows(sequence["obj_trans"], 3);
  RequireFrames(sequence.Where(), "obj_rot", track.orient.cols(), frames);
  RequireFrames(sequence.Where(), "obj_trans", track.trans.cols(), frames);
  if (const auto value = sequence.Find("obj_scale"); value && value->HoldsNumbers()) {
    const std::vector<double> scales = value->Array().AsDoubles();
    if (scales.empty() || !(scales[0] > 0.0) || !std::isfinite(scales[0])) {
      throw Error(value->Where(), "has no positive scale", "Check the file");
    }
    imported.object_mesh_scale = scales[0];
    if (std::ranges::any_of(scales,
                            [&](double s) { return std::abs(s / scales[0] - 1.0) > 1e-3; })) {
      imported.notes.push_back("warning: obj_scale varies: that of the first frame is used");
    }
  }
  imported.conventions.push_back("object: x = s R x + t");
  const std::string mesh = fmt::format("captured_objects/{}_cleaned_simplified.obj", track.name);
  FindObjectMesh(path, {&mesh, 1}, options, imported);
}

}  // namespace

bool LooksLikeOmomo(const Fields& fields) {
  if (IsSequence(fields)) return true;
  const std::vector<std::string> names = fields.Names();
  if (names.empty()) return false;
  const DataValue first = fields[names[0]];
  return first.Kind() == DataKind::kDict && IsSequence(Fields(first));
}

ImportedClip ImportOmomo(const Fields& fields, const std::filesystem::path& path,
                         const ParameterOptions& options) {
  const std::vector<std::string> names = fields.Names();
  const bool one = IsSequence(fields);
  if (!one && static_cast<std::size_t>(options.person) >= names.size()) {
    throw Error(path.string(), fmt::format("has {} sequences", names.size()),
                "Choose one with --person, counted from 0");
  }
  const Fields sequence = one ? fields : fields.In(names[options.person]);
  ParameterOptions known = options;
  if (!known.source_frame_rate) known.source_frame_rate = 30.0;
  ParameterCollector collector(known);
  collector.Add(sequence);
  ImportedClip imported = collector.Collect(true);
  imported.format = fmt::format("OMOMO, sequence '{}'", TextOf(sequence, "seq_name"));
  if (!one && names.size() > 1) {
    imported.notes.push_back(fmt::format("sequence {} of {} is used (choose with --person)",
                                         options.person, names.size()));
  }
  ReadOmomosObject(sequence, path, options, imported);
  imported.dropped.clear();
  constexpr std::array<std::string_view, 9> kUsed = {"seq_name", "root_orient", "pose_body",
                                                     "trans",    "betas",       "gender",
                                                     "obj_rot",  "obj_trans",   "obj_scale"};
  DropUnused(sequence, kUsed, imported);
  SettleWorld(imported, options, UpAxis::kZ, false);
  return imported;
}

bool LooksLikeMdm(const Fields& fields) {
  const auto thetas = fields.Find("thetas"), place = fields.Find("root_translation");
  return thetas && place && thetas->HoldsNumbers() && place->HoldsNumbers();
}

ImportedClip ImportMdm(const Fields& fields, const std::filesystem::path&,
                       const ParameterOptions& options) {
  constexpr std::size_t kJoints = 24, kNumbers = 6;
  const NpyMember member = fields["thetas"].Array(), place = fields["root_translation"].Array();
  const std::vector<std::size_t>& shape = member.array.shape;
  const bool known = shape.size() == 3 && shape[0] == kJoints && shape[1] == kNumbers;
  if (!known || place.array.shape != std::vector<std::size_t>{3, shape[2]}) {
    throw Error(member.where,
                fmt::format("has shape {}, with {} for root_translation", member.ShapeText(),
                            place.ShapeText()),
                "Give (24, 6, T) and (3, T), as MDM writes them");
  }
  const std::size_t frames = shape[2];
  const std::vector<double> thetas = member.AsDoubles(), roots = place.AsDoubles();
  ImportedClip imported;
  Clip& clip = imported.clip;
  clip.trans = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>(
      roots.data(), 3, static_cast<Eigen::Index>(frames));
  clip.pose.assign(frames, AddHandMean(*options.body, JointPose::Zero()));
  for (std::size_t t = 0; t < frames; ++t) {
    for (std::size_t j = 0; j < kNumBodyJoints; ++j) {  // its two hand joints are not used
      Eigen::Vector3d rows[2];
      for (std::size_t k = 0; k < kNumbers; ++k) {
        rows[k / 3][k % 3] = thetas[(j * kNumbers + k) * frames + t];
      }
      const Eigen::Vector3d first = rows[0].normalized();
      const Eigen::Vector3d rest = rows[1] - first.dot(rows[1]) * first;
      if (!(rows[0].norm() > 1e-3 && rest.norm() > 1e-3 && rest.allFinite())) {
        throw Error(member.where, fmt::format("has no rotation for joint {} of frame {}", j, t),
                    "Check the file");
      }
      Eigen::Matrix3d rotation;
      rotation << first.transpose(), rest.normalized().transpose(),
          first.cross(rest.normalized()).transpose();
      clip.pose[t].col(static_cast<Eigen::Index>(j)) = LogSO3(rotation);
    }
  }
  imported.format = "MDM's SMPL parameters";
  clip.surface_model_type = "smpl";
  clip.frame_rate = options.source_frame_rate.value_or(20.0);
  imported.conventions.push_back("6D rotations are two rows of a matrix; 20 Hz as in HumanML3D");
  imported.notes.push_back("the file has no fingers: the relaxed hand is used");
  constexpr std::array<std::string_view, 2> kUsed = {"thetas", "root_translation"};
  DropUnused(fields, kUsed, imported);
  SettleWorld(imported, options, UpAxis::kY, true);
  return imported;
}

}  // namespace holdfast
