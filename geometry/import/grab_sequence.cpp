// SPDX-License-Identifier: MIT
#include "geometry/import/grab_sequence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

using Eigen::Index;

constexpr double kGrabFrameRate = 120;  // Hz, of the capture
constexpr int kLabels = 256;

// Reads labels (T, V) of any integer type into a (V x T) matrix.
ContactLabels::Matrix ReadLabels(const DataValue& value, Index frames) {
  const NpyMember member = value.Array();
  member.RequireShape({static_cast<std::ptrdiff_t>(frames), -1});
  const auto vertices = static_cast<Index>(member.array.shape[1]);
  ContactLabels::Matrix labels(vertices, frames);
  const bool bytes = member.array.item_size == 1 && !member.array.fortran_order &&
                     (member.array.kind == 'u' || member.array.kind == 'b');
  if (bytes) {
    if (labels.size() > 0) {
      std::memcpy(labels.data(), member.array.data.data(), static_cast<std::size_t>(labels.size()));
    }
    return labels;
  }
  const std::vector<std::int64_t> values = member.AsIntegers();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] < 0 || values[i] >= kLabels) {
      throw Error(member.where,
                  fmt::format("holds the label {} in frame {}", values[i],
                              static_cast<Index>(i) / std::max<Index>(vertices, 1)),
                  "Labels are 0 to 255");
    }
    labels(static_cast<Index>(i)) = static_cast<std::uint8_t>(values[i]);
  }
  return labels;
}

double ReadGrabFrameRate(const Fields& fields, const ParameterOptions& options,
                         ImportedClip& imported) {
  if (const auto rate = fields.Find("framerate")) {
    const double value = rate->Number();
    if (!(value > 0) || !std::isfinite(value)) {
      throw Error(rate->Where(), fmt::format("is {}", value), "Give frames per second (GRAB: 120)");
    }
    return value;
  }
  if (options.source_frame_rate) return *options.source_frame_rate;
  imported.notes.push_back(
      "warning: the file has no framerate: assuming GRAB's 120 Hz (--source-fps overrides this)");
  return kGrabFrameRate;
}

// Action of a sequence: the word in the file's name if there is one, else the intent ("mug_drink_1"
// has only the intent "use").
std::string ActionOf(const Fields& fields, const std::filesystem::path& path) {
  const std::string intent = TextOf(fields, "motion_intent");
  const std::string object = TextOf(fields, "obj_name");
  std::string stem = path.stem().string();
  if (!object.empty() && stem.starts_with(object + "_")) {
    stem = stem.substr(object.size() + 1);
    const std::string action = stem.substr(0, stem.find('_'));
    if (!action.empty()) return action;
  }
  return intent;
}

void ReadBody(const Fields& fields, const ParameterOptions& options, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const Fields params = fields.In("body").In("params");
  clip.trans = ReadFrameRows(params["transl"], 3);
  const bool complete = params.Has("fullpose");
  clip.pose = RestPoses(clip.trans.cols(), params[complete ? "fullpose" : "body_pose"], 63);
  if (const auto full = params.Find("fullpose")) {
    SetJoints(clip.pose, 0, ReadRotations(*full, kNumJoints, imported, clip.trans.cols()),
              full->Where());
    imported.conventions.push_back(
        "the body's pose is read from `fullpose`, finger angles are complete (the 24 hand "
        "coefficients encode the same hands)");
  } else {
    imported.notes.push_back(
        "the file has no `fullpose`: the pose is read from its parts, the hands from coefficients");
    ReadBodyJoints(params, true, imported);
    if (options.hands != ImportedHands::kNone) {
      FingerAngles fingers(options);
      for (const Side side : {Side::kLeft, Side::kRight}) {
        const DataValue value = params[fmt::format("{}_hand_pose", SideName(side))];
        SetJoints(clip.pose, HandBegin(side),
                  fingers.Read(value, side, imported, clip.trans.cols()), value.Where());
      }
      // The body's coefficients are relative to the mean hand (the smplx package's default).
      if (!options.flat_hand_mean.value_or(false)) fingers.AddMean(clip.pose);
      Append(imported.conventions, fingers.Conventions());
      Append(imported.notes, fingers.Notes());
    }
  }
  clip.surface_model_type = "smplx";
}

// Reads a MANO hand in the world frame.
void ReadHand(const Fields& fields, Side side, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const Fields params = fields.In(side == Side::kRight ? "rhand" : "lhand").In("params");
  clip.trans = ReadFrameRows(params["transl"], 3);
  clip.pose = RestPoses(clip.trans.cols(), params["fullpose"], kHandDofs);
  SetJoints(clip.pose, 0, ReadRotations(params["global_orient"], 1, imported, clip.trans.cols()),
            params["global_orient"].Where());
  const DataValue full = params["fullpose"];
  SetJoints(clip.pose, HandBegin(side),
            ReadRotations(full, kJointsPerHand, imported, clip.trans.cols()), full.Where());
  clip.surface_model_type = "mano";
  imported.conventions.push_back(
      fmt::format("the {} hand alone, as MANO: root_orient is the wrist's rotation, fingers are "
                  "read from `fullpose` (flat)",
                  SideName(side)));
}

}  // namespace

bool LooksLikeGrab(const Fields& fields) {
  return fields.Has("body") && fields.Has("object") &&
         (fields.Has("rhand") || fields.Has("contact") || fields.Has("motion_intent"));
}

std::uint8_t HandsTouching(std::span<const std::uint8_t> labels) {
  std::uint8_t hands = 0;
  for (const std::uint8_t label : labels) {
    // A label is the SMPL-X joint of the touching part + 1.
    const int joint = label - 1;
    const auto of = [&](Side side) {
      return joint == WristJoint(side) ||
             (joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand);
    };
    if (of(Side::kRight)) hands |= kHoldsRight;
    if (of(Side::kLeft)) hands |= kHoldsLeft;
  }
  return hands;
}

ImportedClip ImportGrab(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options) {
  ImportedClip imported;
  imported.format = "GRAB sequence";
  Clip& clip = imported.clip;
  const bool right = options.hands == ImportedHands::kRightAlone;
  const bool alone = right || options.hands == ImportedHands::kLeftAlone;
  clip.frame_rate = ReadGrabFrameRate(fields, options, imported);
  if (alone) {
    ReadHand(fields, right ? Side::kRight : Side::kLeft, imported);
  } else {
    ReadBody(fields, options, imported);
  }
  const Index frames = clip.trans.cols();

  const Fields object = fields.In("object");
  clip.object = ReadRowTrack(object.In("params"), frames, imported);
  clip.object->name = TextOf(fields, "obj_name");
  imported.conventions.push_back(
      "rotations of object and table act on row vectors (v R + t): transposed for column vectors");
  const auto find_mesh = [&](const Fields& thing, std::string_view key) {
    const std::string name = TextOf(thing, key);
    const std::filesystem::path mesh = FindInDataSet(path, name, options);
    if (mesh.empty() && !name.empty()) {
      imported.notes.push_back(
          fmt::format("{} was not found beside the file or in the folders above it (give the "
                      "folder of the data set with --data-root, or the mesh with --object-mesh)",
                      name));
    }
    return mesh;
  };
  imported.object_mesh = find_mesh(object, "object_mesh");
  if (fields.Has("table")) {
    const Fields table = fields.In("table");
    clip.table = ReadRowTrack(table.In("params"), frames, imported);
    clip.table->name = "table";
    imported.table_mesh = FindInDataSet(path, TextOf(table, "table_mesh"), options);
  }

  const Fields person = fields.In(!alone ? "body" : right ? "rhand" : "lhand");
  ReadSubject(path, TextOf(person, "vtemp"), options, imported);
  if (!alone) NoteTemplate(*options.body, imported);
  if (const auto gender = fields.Find("gender")) {
    clip.gender = GenderOf(*gender).value_or("neutral");
  }
  clip.subject = TextOf(fields, "sbj_id");
  clip.action = ActionOf(fields, path);

  if (fields.Has("contact")) {
    const Fields contact = fields.In("contact");
    ContactLabels labels;
    if (const auto on = contact.Find("object")) labels.object = ReadLabels(*on, frames);
    if (const auto on = contact.Find("body"); on && !alone) labels.body = ReadLabels(*on, frames);
    for (Index t = 0; t < frames && labels.object.size() > 0; ++t) {
      std::uint8_t hands =
          HandsTouching({&labels.object(0, t), static_cast<std::size_t>(labels.object.rows())});
      if (alone) hands &= right ? kHoldsRight : kHoldsLeft;
      clip.holding_hand.push_back(hands);
    }
    clip.contact = std::move(labels);
    imported.conventions.push_back(
        "holding_hand is derived from contact: hand and finger labels on the object's vertices");
  }
  if (!alone && fields.In("body").In("params").Has("expression")) {
    imported.dropped.push_back("body.params.expression: clips store no facial expression");
  }
  if (!alone && (fields.Has("rhand") || fields.Has("lhand"))) {
    imported.dropped.push_back(
        "rhand, lhand: the same hands as MANO (import one with --hands rhand)");
  }
  constexpr std::array<std::string_view, 13> kUsed = {
      "gender", "sbj_id", "obj_name", "motion_intent", "framerate", "body",   "rhand",
      "lhand",  "object", "table",    "contact",       "n_frames",  "n_comps"};
  DropUnused(fields, kUsed, imported);
  SettleWorld(imported, options, UpAxis::kZ, false);
  return imported;
}

namespace {

namespace fs = std::filesystem;

constexpr double kArcticFrameRate = 30;
constexpr double kMillimeter = 1e-3;
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

// Returns "box_grab_01" for "box_grab_01.smplx.npy".
std::string SequenceOf(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.substr(0, name.find('.'));
}

void ReadObject(const fs::path& path, ImportedClip& imported) {
  Clip& clip = imported.clip;
  const fs::path object = path.parent_path() / (SequenceOf(path) + ".object.npy");
  std::error_code ignored;
  if (!fs::is_regular_file(object, ignored)) {
    imported.notes.push_back(
        fmt::format("no {} beside it: imported without an object", object.filename().string()));
    return;
  }
  const DataFile file(object);
  const Eigen::MatrixXd rows = ReadFrameRows(file.Root(), kObjectNumbers);
  RequireFrames(object.string(), "array", rows.cols(), clip.trans.cols());
  ObjectTrack track;
  track.orient = rows.middleRows(1, 3);
  track.trans = kMillimeter * rows.bottomRows(3);
  const std::string sequence = SequenceOf(path);
  track.name = sequence.substr(0, sequence.find('_'));
  clip.object = std::move(track);
  imported.conventions.push_back(
      "the object's rotation acts on column vectors; its translation was in millimeters");
  const double opened = rows.row(0).maxCoeff() - rows.row(0).minCoeff();
  imported.dropped.push_back(
      fmt::format("the object's articulation (it opens by {:.2f} rad): objects in clips are rigid; "
                  "the track is that of the base",
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
    imported.object_mesh_scale = kMillimeter;
    if (imported.object_mesh.empty()) {
      imported.notes.push_back(
          fmt::format("meta/object_vtemplates/{}/mesh.obj was not found (give the folder of "
                      "ARCTIC's data with --data-root, or the mesh with --object-mesh)",
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
                body ? "Give that file, or omit --hands"
                     : "Choose one with --hands rhand or lhand, or give the .smplx.npy beside it");
  }
  ParameterOptions known = options;
  const bool rate_known = known.source_frame_rate.has_value();
  if (!rate_known) known.source_frame_rate = kArcticFrameRate;
  ImportedClip imported;
  if (body) {
    ParameterCollector collector(known);
    collector.Add(fields);
    imported = collector.Collect(true);
  } else {
    constexpr std::array<std::string_view, 1> kTransName = {"trans"}, kBetasName = {"shape"};
    const Side side = right ? Side::kRight : Side::kLeft;
    imported = ReadHandAlone(fields.In(SideName(side)), {"rot", "pose", kTransName, kBetasName},
                             side, known.flat_hand_mean.value_or(false), known);
    imported.clip.frame_rate = *known.source_frame_rate;
  }
  imported.format = body ? "ARCTIC sequence" : "ARCTIC sequence, a hand alone";
  if (!rate_known) {
    imported.notes.push_back(
        fmt::format("no frame rate in the file: assuming ARCTIC's {:g} Hz", kArcticFrameRate));
  }
  Clip& clip = imported.clip;
  const std::string sequence = SequenceOf(path);
  clip.subject = path.parent_path().filename().string();
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
  // The rotation of a wrist does not show which axis is up.
  SettleWorld(imported, options, body ? std::nullopt : std::optional(UpAxis::kZ), body);
  return imported;
}

}  // namespace holdfast
