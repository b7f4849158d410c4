// SPDX-License-Identifier: MIT
#include "geometry/import/arctic.h"

#include <array>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/finger_angles.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;

constexpr double kArcticFrameRate = 30;
constexpr double kMillimetre = 1e-3;
constexpr int kObjectNumbers = 7;  // articulation, rotation, translation

bool HasBody(const Fields& fields) {
  return fields.Has("transl") && fields.Has("global_orient") && fields.Has("body_pose") &&
         fields.Has("left_hand_pose") && fields.Has("right_hand_pose") && !fields.Has("betas");
}

bool HasHands(const Fields& fields) {
  if (!fields.Has("left") || !fields.Has("right")) return false;
  const Fields right = fields.In("right");
  return right.Has("rot") && right.Has("pose") && right.Has("trans");
}

// "box_grab_01" of "box_grab_01.smplx.npy".
std::string SequenceOf(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.substr(0, name.find('.'));
}

std::string SubjectOf(const fs::path& path) { return path.parent_path().filename().string(); }

ImportedClip ImportHandAlone(const Fields& fields, Side side, const ParameterOptions& options) {
  constexpr std::array<std::string_view, 1> kTransName = {"trans"}, kBetasName = {"shape"};
  ImportedClip imported =
      ReadHandAlone(fields.In(SideName(side)), {"rot", "pose", kTransName, kBetasName}, side,
                    options.flat_hand_mean.value_or(false), options);
  imported.clip.frame_rate = options.source_frame_rate;
  return imported;
}

void ReadObject(const fs::path& path, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const fs::path object = path.parent_path() / (SequenceOf(path) + ".object.npy");
  std::error_code ignored;
  if (!fs::is_regular_file(object, ignored)) {
    imported.notes.push_back(fmt::format("no {} beside it: no object", object.filename().string()));
    return;
  }
  const DataFile file(object);
  const Eigen::MatrixXd rows = ReadFrameRows(file.Root(), kObjectNumbers);
  RequireFrames(object.string(), "array", rows.cols(), clip.trans.cols());
  ObjectTrack track;
  track.orient = rows.middleRows(1, 3);
  track.trans = kMillimetre * rows.bottomRows(3);
  const std::string sequence = SequenceOf(path);
  track.name = sequence.substr(0, sequence.find('_'));
  clip.object = std::move(track);
  imported.conventions.push_back(
      "the object's rotation is for columns, its translation was in millimetres");
  const double opened = rows.row(0).maxCoeff() - rows.row(0).minCoeff();
  imported.dropped.push_back(
      fmt::format("the object's articulation (it opens by {:.2f} rad): a clip's object is rigid, "
                  "the track is its base's",
                  opened));
}

void ReadMeta(const fs::path& path, const ParameterOptions& options, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const auto find = [&](const std::string& name) {
    const fs::path found = FindInDataSet(path, "meta/" + name, options);
    return found.empty() ? FindInDataSet(path, "data/meta/" + name, options) : found;
  };
  if (clip.object) {
    imported.object_mesh = find(fmt::format("object_vtemplates/{}/mesh.obj", clip.object->name));
    imported.object_mesh_scale = kMillimetre;
    if (imported.object_mesh.empty()) {
      imported.notes.push_back(
          fmt::format("meta/object_vtemplates/{}/mesh.obj was not found (--data-root says where "
                      "ARCTIC's data is, --object-mesh which mesh to take)",
                      clip.object->name));
    }
  }
  if (const fs::path misc = find("misc.json"); !misc.empty()) {
    const DataFile file(misc);
    const Fields subjects(file);
    if (subjects.Has(clip.subject)) {
      const Fields subject = subjects.In(clip.subject);
      if (const auto gender = subject.Find("gender")) {
        clip.gender = GenderOf(*gender).value_or(clip.gender);
      }
    }
  }
}

}  // namespace

bool LooksLikeArctic(const DataFile& file, const Fields& fields) {
  return file.Format() == DataFormat::kNpy && (HasBody(fields) || HasHands(fields));
}

ImportedClip ImportArctic(const Fields& fields, const fs::path& path,
                          const ParameterOptions& options) {
  const bool body = HasBody(fields);
  const bool right = options.hands == ImportedHands::kRightAlone;
  const bool alone = right || options.hands == ImportedHands::kLeftAlone;
  if (alone == body) {
    throw Error(path.string(),
                body ? "holds a body; its hands as MANO are in the .mano.npy beside it"
                     : "holds hands alone (MANO)",
                body ? "Give that file, or leave --hands out"
                     : "Choose one with --hands rhand or lhand, or give the .smplx.npy beside it");
  }
  ParameterOptions known = options;
  const bool rate_known = known.source_frame_rate > 0;
  if (!rate_known) known.source_frame_rate = kArcticFrameRate;
  ImportedClip imported;
  if (body) {
    ParameterCollector collector(known);
    collector.Add(fields);
    imported = collector.Collect(true);
  } else {
    imported = ImportHandAlone(fields, right ? Side::kRight : Side::kLeft, known);
  }
  imported.format = body ? "ARCTIC sequence" : "ARCTIC sequence, a hand alone";
  if (!rate_known) {
    imported.notes.push_back(
        fmt::format("no frame rate in the file: ARCTIC's {:g} Hz taken", kArcticFrameRate));
  }
  Clip& clip = imported.clip;
  const std::string sequence = SequenceOf(path);
  clip.subject = SubjectOf(path);
  if (const std::size_t word = sequence.find('_'); word != std::string::npos) {
    clip.action = sequence.substr(word + 1, sequence.find('_', word + 1) - word - 1);
  }
  ReadObject(path, imported);
  ReadMeta(path, options, imported);
  if (body) {
    for (const std::string folder : {"meta/", "data/meta/"}) {
      const std::string name = folder + "subject_vtemplates/" + clip.subject + ".obj";
      if (FindInDataSet(path, name, options).empty() && folder == "meta/") continue;
      ReadSubject(path, name, options, imported);
      break;
    }
    NoteTemplate(*options.body, imported);
  }
  // A wrist's turn tells nothing of what is up.
  SettleWorld(imported, options, body ? std::nullopt : std::optional(WorldUp::kPlusZ), body);
  return imported;
}

}  // namespace holdfast
