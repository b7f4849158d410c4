// SPDX-License-Identifier: MIT
#include "geometry/import/imos_result.h"

#include <array>
#include <cctype>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

// Key frame rate assumed for IMoS, Hz, since its files state none. Its 15 frames, drawn at this
// rate, are a 20th of the time of contact apart; the paper quotes 8 to 10 Hz (section 4).
constexpr double kImosFrameRate = 10;

std::vector<std::string> Words(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == '_') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  return words;
}

// Reads subject and action from a name that contains the object's: "s10_mug_drink_1",
// "grab/s10/mug_drink_1.npz", "mug_drink_1".
void ReadNames(const std::string& sequence, const std::filesystem::path& path,
               const std::string& object, Clip& clip) {
  const auto is_subject = [](const std::string& word) {
    return word.size() > 1 && word[0] == 's' && std::isdigit(static_cast<unsigned char>(word[1]));
  };
  for (const std::filesystem::path& name : {std::filesystem::path(sequence), path}) {
    const std::vector<std::string> words = Words(name.stem().string());
    if (clip.subject.empty()) {
      if (is_subject(words[0])) clip.subject = words[0];
      if (const std::string above = name.parent_path().filename().string(); is_subject(above)) {
        clip.subject = above;
      }
    }
    for (std::size_t i = 0; clip.action.empty() && i + 1 < words.size(); ++i) {
      if (words[i] == object) clip.action = words[i + 1];
    }
  }
}

bool ThirdJointsAreZero(const Eigen::MatrixXd& fingers) {
  for (int finger = 0; finger < 5; ++finger) {
    if (!fingers.middleRows(9 * finger + 6, 3).isZero(0.0)) return false;
  }
  return true;
}

void ReadHands(const Fields& subject, const ParameterOptions& options, ImportedClip& imported) {
  Clip& clip = imported.clip;
  FingerAngles fingers(options);
  bool third_joints_zero = true, angles = false;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const std::string name = fmt::format("{}_hand_pose", SideName(side));
    const auto value = subject.Find(name);
    if (!value) {
      imported.notes.push_back(fmt::format("no {}: that hand is left flat", name));
      continue;
    }
    const int numbers = NumbersPerHand(*value, clip.trans.cols());
    SetJoints(clip.pose, HandBegin(side), fingers.Read(*value, side, imported, clip.trans.cols()),
              value->Where());
    if (numbers == kHandDofs) {
      angles = true;
      third_joints_zero = third_joints_zero && ThirdJointsAreZero(ReadFrameRows(*value, kHandDofs));
    }
  }
  if (!options.flat_hand_mean.value_or(true)) fingers.AddMean(clip.pose);
  Append(imported.conventions, fingers.Conventions());
  Append(imported.notes, fingers.Notes());
  if (angles && third_joints_zero) {
    imported.notes.push_back(
        "the third joint of every finger is exactly zero, so the 45 numbers of a hand are taken as "
        "axis-angle; the authors' viewer reads them as principal components on top of a mean hand");
  }
}

}  // namespace

bool LooksLikeImos(const Fields& fields) { return fields.Has("sbj_p") && fields.Has("obj_p"); }

ImportedClip ImportImos(const Fields& fields, const std::filesystem::path& path,
                        const ParameterOptions& options) {
  ImportedClip imported;
  imported.format = "IMoS result";
  Clip& clip = imported.clip;
  clip.frame_rate = options.source_frame_rate.value_or(kImosFrameRate);
  const Fields subject = fields.In("sbj_p");
  clip.trans = ReadFrameRows(subject["transl"], 3);
  clip.pose = RestPoses(clip.trans.cols(), subject["body_pose"], 63);
  ReadBodyJoints(subject, false, imported);
  if (options.hands == ImportedHands::kNone) {
    for (JointPose& pose : clip.pose) pose = AddHandMean(*options.body, pose);
  } else {
    ReadHands(subject, options, imported);
  }
  clip.object = ReadRowTrack(fields.In("obj_p"), clip.trans.cols(), imported);
  clip.object->name = TextOf(fields, "obj_name");
  imported.conventions.push_back(
      "the object's rotations act on row vectors (v R + t): transposed for column vectors");

  const auto surface = fields.Has("sbj_vtemp")     ? fields.Find("sbj_vtemp")
                       : subject.Has("v_template") ? subject.Find("v_template")
                                                   : std::nullopt;
  if (surface) {
    clip.v_template = ReadFrameRows(*surface, 3);
    imported.conventions.push_back(
        "the body shape is the subject's own surface (the file's template); betas stay zero");
    NoteTemplate(*options.body, imported);
  }
  if (const auto gender = fields.Find("gender")) {
    clip.gender = GenderOf(*gender).value_or("neutral");
  }
  ReadNames(TextOf(fields, "sequence_name"), path, clip.object->name, clip);

  for (const std::string folder : {"new_contact_meshes", "contact_meshes"}) {
    if (!imported.object_mesh.empty() || clip.object->name.empty()) break;
    for (const std::string root : {"tools", "GRAB/tools", "DATASETS/GRAB/tools"}) {
      imported.object_mesh = FindInDataSet(
          path, fmt::format("{}/object_meshes/{}/{}.ply", root, folder, clip.object->name),
          options);
      if (!imported.object_mesh.empty()) break;
    }
  }
  if (imported.object_mesh.empty()) {
    imported.notes.push_back(
        fmt::format("GRAB's mesh of '{}' was not found in the folders above the file (give the "
                    "folder of GRAB with --data-root, or the mesh with --object-mesh)",
                    clip.object->name));
  }
  imported.conventions.push_back(
      fmt::format("{} key frames at {:g} Hz", clip.NumFrames(), clip.frame_rate));
  if (!options.source_frame_rate) {
    imported.notes.push_back(
        fmt::format("warning: no frame rate in the file: assuming {:g} Hz, the paper has 8 to 10 "
                    "('holdfast import --source-fps' overrides this)",
                    kImosFrameRate));
  }
  constexpr std::array<std::string_view, 6> kUsed = {"sbj_p",     "obj_p",  "obj_name",
                                                     "sbj_vtemp", "gender", "sequence_name"};
  DropUnused(fields, kUsed, imported);
  SettleWorld(imported, options, UpAxis::kZ, true);
  return imported;
}

}  // namespace holdfast
