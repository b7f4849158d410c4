// SPDX-License-Identifier: MIT
#include "geometry/import/body_sets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/body/body_kinematics.h"
#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/scene_objects.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// The body of a set that states neither its frame rate nor that its finger angles are complete.
ImportedClip BodyOf(const Fields& fields, const ParameterOptions& options, double rate,
                    std::string format) {
  ParameterOptions known = options;
  if (!known.source_frame_rate) known.source_frame_rate = rate;
  ParameterCollector collector(known);
  collector.Add(fields);
  ImportedClip imported = collector.Collect(true);
  imported.format = std::move(format);
  return imported;
}

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
  ImportedClip imported = BodyOf(sequence, options, 30.0,
                                 fmt::format("OMOMO, sequence '{}'", TextOf(sequence, "seq_name")));
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

namespace {

// object_pose/S01T001.npy beside the folder of the body.
fs::path HimosObjects(const fs::path& body) {
  std::error_code ignored;
  const fs::path path = fs::absolute(body, ignored).parent_path().parent_path() / "object_pose" /
                        (body.stem().string() + ".npy");
  return fs::is_regular_file(path, ignored) ? path : fs::path();
}

// seq/s1/object_transformations.pkl beside smplx_seq/s1.
fs::path ParaHomesObjects(const fs::path& body) {
  std::error_code ignored;
  const fs::path folder = fs::absolute(body, ignored).parent_path();
  const fs::path path =
      folder.parent_path().parent_path() / "seq" / folder.filename() / "object_transformations.pkl";
  return fs::is_regular_file(path, ignored) ? path : fs::path();
}

// "cup_base": scan/cup/simplified/base.obj.
std::string ScanOf(const std::string& name) {
  const std::size_t bar = std::min(name.rfind('_'), name.size());
  return fmt::format("scan/{}/simplified/{}.obj", name.substr(0, bar),
                     bar < name.size() ? name.substr(bar + 1) : "base");
}

void AddSceneObject(std::vector<SceneObject> objects, const fs::path& from,
                    std::string (*mesh)(const std::string& name), const ParameterOptions& options,
                    ImportedClip& imported) {
  const std::optional<SceneObject> object =
      ChooseObject(std::move(objects), WristPaths(imported.clip, *options.body), options.prop,
                   from.string(), imported.notes);
  if (!object) return;
  const std::string path = mesh(object->name);
  PutObject(*object, from, {&path, 1}, options, imported);
}

}  // namespace

bool LooksLikeHimo(const DataFile& file, const Fields& fields) {
  return fields.Has("lhand_pose") && LooksLikeParameters(fields) &&
         !HimosObjects(file.Path()).empty();
}

ImportedClip ImportHimo(const DataFile& file, const Fields& fields,
                        const ParameterOptions& options) {
  ImportedClip imported = BodyOf(fields, options, 30.0, "HIMO");
  const fs::path path = HimosObjects(file.Path());
  const DataFile objects_file(path);
  const Fields all(objects_file);
  std::vector<SceneObject> objects;
  const Eigen::Index frames = imported.clip.trans.cols();
  for (const std::string& name : all.Names()) {
    const Fields track = all.In(name);
    const Eigen::MatrixXd turns = ReadObjectRotations(track["rot"], imported, frames);
    const Eigen::MatrixXd places = ReadFrameRows(track["transl"], 3);
    RequireFrames(track.Where(), "rot", turns.cols(), frames);
    RequireFrames(track.Where(), "transl", places.cols(), frames);
    SceneObject& object = objects.emplace_back(SceneObject{name, {}});
    for (Eigen::Index t = 0; t < frames; ++t) {
      object.poses.emplace_back(RigidTransform(ExpSO3(turns.col(t)), places.col(t)));
    }
  }
  AddSceneObject(
      std::move(objects), path,
      [](const std::string& name) { return fmt::format("object_mesh/{}.obj", name); }, options,
      imported);
  SettleWorld(imported, options, UpAxis::kY, true);
  return imported;
}

bool LooksLikeParaHome(const DataFile& file, const Fields& fields) {
  std::error_code ignored;
  return fields.Has("hand_pose") && LooksLikeParameters(fields) &&
         fs::is_regular_file(file.Path().parent_path() / "smplx_params.pkl", ignored);
}

ImportedClip ImportParaHome(const DataFile& file, const Fields& fields,
                            const ParameterOptions& options) {
  ImportedClip imported = BodyOf(fields, options, 30.0, "ParaHome");
  const DataFile person(file.Path().parent_path() / "smplx_params.pkl");
  if (const auto beta = person.Root().Find("beta")) SetBetas(ReadBetas(*beta), imported);
  if (const auto gender = person.Root().Find("gender")) {
    if (const auto known = GenderOf(*gender)) imported.clip.gender = *known;
  }
  const fs::path path = ParaHomesObjects(file.Path());
  if (path.empty()) {
    imported.notes.push_back(
        "seq/.../object_transformations.pkl of the set was not found: the clip has no object");
  } else {
    const DataFile objects_file(path);
    const Fields all(objects_file);
    std::map<std::string, SceneObject> objects;
    const auto frames = static_cast<std::size_t>(imported.clip.NumFrames());
    for (std::size_t t = 0; t < frames; ++t) {
      const std::string frame = std::to_string(t);
      if (!all.Has(frame)) continue;
      const Fields poses = all.In(frame);
      for (const std::string& name : poses.Names()) {
        SceneObject& object = objects[name];
        object.name = name;
        object.poses.resize(frames);
        object.poses[t] = ReadRigidPoses(poses[name]).at(0);
      }
    }
    std::vector<SceneObject> list;
    for (auto& [name, object] : objects) list.push_back(std::move(object));
    AddSceneObject(std::move(list), path, ScanOf, options, imported);
  }
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
