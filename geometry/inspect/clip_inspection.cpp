// SPDX-License-Identifier: MIT
#include "geometry/inspect/clip_inspection.h"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/inspect/clip_findings.h"

namespace holdfast {
namespace {

void DescribeArrays(const LooseMotion& motion, Inspection& inspection) {
  std::map<std::string, std::vector<std::string>> groups;
  std::vector<std::string> all;
  for (const LooseArray& array : motion.arrays) {
    const bool turns = array.role != "root position" && array.role != "object position";
    const std::string how =
        turns ? fmt::format("{} {}", array.type, Describe(array.form)) : array.type;
    groups[how].push_back(fmt::format("{} {}", array.key, array.shape));
    all.push_back(fmt::format("{} {} {}", array.key, array.shape, how));
  }
  inspection.AddFact("arrays", fmt::format("{}", fmt::join(all, "; ")), "");
  for (const auto& [how, arrays] : groups) {
    inspection.AddFact("", "", fmt::format("{}: {}", how, fmt::join(arrays, ", ")));
  }
  for (const LooseArray& array : motion.arrays) {
    if (array.out_of_range > 0) {
      inspection.Fault(
          fmt::format("{} holds {} NaN, infinite or huge numbers, the first in frame {}", array.key,
                      array.out_of_range, array.first_out_of_range),
          "cut these frames out or fill them in");
    }
    if (array.form == RotationForm::kMatrix && array.orthonormality_off > 1e-3) {
      inspection.Warn(fmt::format("{} holds matrices that are not rotations (R'R is off by {:.2g})",
                                  array.key, array.orthonormality_off),
                      "take the nearest rotations (singular value decomposition)");
    }
    if (array.form == RotationForm::kCoefficients) {
      const bool hand = array.role.find("hand") != std::string::npos;
      inspection.Fault(fmt::format("{} has shape {}, no rotations{}", array.key, array.shape,
                                   hand ? ": coefficients of the model's hand components" : ""),
                       hand ? "multiply them with the model's hands_components, and add hands_mean"
                            : "see how the program that wrote it stores rotations");
    }
    const bool clip_array = array.role != "object rotation";
    if (clip_array &&
        (array.form == RotationForm::kMatrix || array.form == RotationForm::kQuaternion ||
         array.form == RotationForm::kSixD)) {
      inspection.Fault(
          fmt::format("{} holds {} where axis-angle is needed", array.key, Describe(array.form)),
          "write it as axis-angle (scipy's Rotation.as_rotvec)");
    }
  }
  for (const std::string& problem : motion.problems) {
    inspection.Fault(problem, "save it again as plain numbers");
  }
}

void DescribeModel(const LooseMotion& motion, Inspection& inspection) {
  const auto text = [&](const char* key) {
    const auto found = motion.texts.find(key);
    return found == motion.texts.end() ? std::string() : found->second;
  };
  const std::string type = text("surface_model_type"), gender = text("gender"),
                    body = text("body_model");
  if (motion.IsHandAlone()) {
    const std::string hand = "a hand alone (MANO), as a body's";
    inspection.AddFact("body", hand, "body: " + hand + (body.empty() ? "" : " '" + body + "'"));
    return;
  }
  std::string line = motion.num_joints == 52   ? "SMPL-H (52 joints)"
                     : motion.num_joints == 24 ? "SMPL (24 joints)"
                                               : "SMPL-X (55 joints)";
  inspection.AddFact("body_model_family", line, "");
  if (!body.empty()) line += fmt::format(", of the model '{}'", body);
  if (!gender.empty()) line += ", " + gender;
  line += motion.num_betas < 0 ? ", no betas" : fmt::format(", {} betas", motion.num_betas);
  inspection.AddFact("body", line, "body: " + line);
  const bool model_unlike = !type.empty() && motion.num_joints == kNumJoints && type != "smplx" &&
                            type != "smplx_locked_head";
  if (model_unlike) {
    inspection.Warn(fmt::format("surface_model_type says '{}', the arrays are SMPL-X's", type),
                    "trust the arrays, or ask who wrote the file");
  }
}

}  // namespace

void InspectClip(Inspection& inspection) {
  const std::string word = ShellWord(inspection.path);
  LooseMotion motion;
  try {
    motion = ReadLooseMotion(NpzReader(inspection.path));
  } catch (const Error& error) {
    inspection.Fault(error.Problem(), error.Remedy());
    return;
  }
  if (motion.has_object) inspection.title += ", with an object";
  if (motion.frame_rate > 0) {
    inspection.AddFact("frames", motion.frames,
                       fmt::format("{} frames at {:g} Hz: {:.2f} s", motion.frames,
                                   motion.frame_rate, motion.frames / motion.frame_rate));
    inspection.AddFact("frame_rate_hz", motion.frame_rate, "");
    if (motion.frame_rate < 5 || motion.frame_rate > 1000) {
      inspection.Warn(fmt::format("a frame rate of {:g} Hz is unusual", motion.frame_rate),
                      "check mocap_frame_rate");
    }
  } else {
    inspection.AddFact(
        "frames", motion.frames,
        fmt::format("{} frame{}, no frame rate", motion.frames, motion.frames == 1 ? "" : "s"));
  }
  DescribeModel(motion, inspection);
  DescribeArrays(motion, inspection);
  Clip turned;
  turned.pose = std::move(motion.pose);
  if (const std::string note = WrapJointAngles(turned); !note.empty()) {
    inspection.Warn(note.substr(std::string_view("warning: ").size()), "");
  }
  motion.pose = std::move(turned.pose);
  if (motion.lengths_differ) {
    inspection.Fault("the arrays have different numbers of frames", "cut them to the same length");
  }
  const bool too_long = motion.frames >= static_cast<int>(kMaxLooseFrames);
  if (too_long) {
    inspection.Fault(fmt::format("more than {} frames", kMaxLooseFrames), "cut it into parts");
  }

  // What fit, render and the others would say.
  if (inspection.Worst() != Verdict::kFault) {
    try {
      const NpzReader archive(inspection.path);
      ReadClip(archive);
      if (const auto note = OldPelvisNote(archive)) inspection.Ok(*note);
    } catch (const Error& error) {
      const std::string where = error.Where();
      const auto bracket = where.rfind('[');
      inspection.Fault(fmt::format("{} {}",
                                   bracket == std::string::npos
                                       ? "the file"
                                       : where.substr(bracket + 1, where.size() - bracket - 2),
                                   error.Problem()),
                       error.Remedy());
    }
  }
  if (motion.frames > 0 && !too_long) {
    const auto body = BodyModel::Default();
    const double metres_per_unit = DescribeBodyMotion(motion, *body, inspection);
    DescribeHands(motion, *body, inspection);
    DescribeObject(motion, *body, metres_per_unit, inspection);
    if (inspection.Worst() != Verdict::kFault) {
      LoadedClip clip;
      clip.file = inspection.path;
      clip.clip = ReadClip(inspection.path);
      ClipObject object;
      try {
        object = FindClipObject(clip);
      } catch (const Error& error) {
        inspection.Fault(fmt::format("{} {}", error.Where(), error.Problem()), error.Remedy());
      }
      if (!object.missing.empty()) {
        inspection.AddFact("object_missing", object.missing,
                           "no mesh of the object: " + object.missing);
      }
      if (object.by_name) object.mesh.reset();
      DescribeOnBody(clip.clip, object.mesh, body, inspection);
    }
  }

  if (inspection.Worst() != Verdict::kFault) {
    const std::string stem = Stem(inspection.path);
    if (motion.IsHandAlone()) {
      ProposeForHandAlone(ReadClip(inspection.path), word, ShellWord(stem), inspection);
    } else if (motion.has_object) {
      inspection.next.push_back(fmt::format("holdfast score {}", word));
      inspection.next.push_back(
          fmt::format("holdfast report {} -o {}.html", word, ShellWord(stem)));
      inspection.next.push_back(
          fmt::format("holdfast render {} -o {}.mp4 --camera hand", word, ShellWord(stem)));
    } else {
      inspection.next.push_back(
          fmt::format("holdfast fit {} mug -o {}", word, ShellWord(stem + "_held")));
      inspection.next.push_back(fmt::format("holdfast render {} -o {}.png", word, ShellWord(stem)));
    }
  }
}

}  // namespace holdfast
