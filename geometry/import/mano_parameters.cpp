// SPDX-License-Identifier: MIT
#include "geometry/import/mano_parameters.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/finger_angles.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"

namespace holdfast {
namespace {

constexpr std::array<std::string_view, 5> kHandTrans = {"transl", "trans", "translation",
                                                        "root_trans", "cam_trans"};
constexpr std::array<std::string_view, 3> kHandBetas = {"betas", "shape", "beta"};
constexpr std::array<std::string_view, 3> kIsRight = {"is_rhand", "is_right", "right"};
constexpr std::array<std::string_view, 4> kHandInside = {"pred_mano_params", "mano_params", "mano",
                                                         "params"};

bool HasHand(const Fields& fields) {
  return fields.Has("global_orient") && fields.Has("hand_pose") && !fields.Has("body_pose");
}

std::optional<Fields> FindHand(const Fields& fields) {
  if (HasHand(fields)) return fields;
  for (const std::string_view name : kHandInside) {
    if (!fields.Has(name)) continue;
    try {
      const Fields inside = fields.In(name);
      if (HasHand(inside)) return inside;
    } catch (const Error&) {
      continue;  // no dict
    }
  }
  return std::nullopt;
}

// The hand that the file tells, where it does.
std::optional<Side> ToldSide(const Fields& fields, ImportedClip& imported) {
  const auto name = fields.FirstOf(kIsRight);
  if (!name) return std::nullopt;
  const DataValue value = fields[*name];
  if (!value.HoldsNumbers()) return std::nullopt;
  const std::vector<double> right = value.Array().AsDoubles();
  if (right.empty()) return std::nullopt;
  if (std::ranges::any_of(right, [&](double r) { return (r != 0) != (right[0] != 0); })) {
    throw Error(value.Where(), "names both hands in one motion", "Give one hand a file");
  }
  if (right[0] != 0) return Side::kRight;
  if (*name != "is_rhand") {
    imported.notes.push_back(fmt::format(
        "warning: {} is 0: a left hand taken. HaMeR's own output keeps a left hand as its mirrored "
        "right one: mirror it before, if it is that",
        *name));
  }
  return Side::kLeft;
}

Side SideOf(const Fields& fields, const ParameterOptions& options, ImportedClip& imported) {
  std::optional<Side> of_options = options.body->LoneHand();
  if (options.hands == ImportedHands::kLeftAlone) of_options = Side::kLeft;
  if (options.hands == ImportedHands::kRightAlone) of_options = Side::kRight;
  if (const std::optional<Side> model = options.body->LoneHand(); model && model != of_options) {
    throw Error("--hands",
                fmt::format("asks for a {} hand, {} is a {} one", SideName(*of_options),
                            options.body->Name(), SideName(*model)),
                "Leave --hands out, or give the other hand's model");
  }
  const bool asked = of_options.has_value();
  const Side wanted = of_options.value_or(Side::kRight);
  if (const std::optional<Side> told = ToldSide(fields, imported)) {
    if (asked && *told != wanted) {
      throw Error(
          fields.Where(),
          fmt::format("is of a {} hand, a {} one is asked for", SideName(*told), SideName(wanted)),
          fmt::format("Give --hands {0}hand, or the body model of a {1} hand",
                      *told == Side::kRight ? 'r' : 'l', SideName(*told)));
    }
    return *told;
  }
  if (!asked) {
    imported.notes.push_back(
        "which hand it is the file does not tell: a right one taken (--hands lhand says "
        "otherwise)");
  }
  return wanted;
}

void ListUnusedOfHand(const Fields& packed, const Fields& fields, ImportedClip& imported) {
  const auto used = [](const std::string& name) {
    for (const std::span<const std::string_view> names :
         {std::span<const std::string_view>(kHandTrans), {kHandBetas}, {kIsRight}, {kHandInside}}) {
      if (std::ranges::find(names, name) != names.end()) return true;
    }
    return name == "global_orient" || name == "hand_pose" || name == "gender" ||
           name == "flat_hand_mean" || name == "model_type" || IsFrameRateName(name);
  };
  std::vector<std::string> unused;
  for (const Fields* some : {&fields, &packed}) {
    for (const std::string& name : some->Names()) {
      if (!used(name) && std::ranges::find(unused, name) == unused.end()) unused.push_back(name);
    }
  }
  if (!unused.empty()) imported.dropped.push_back(fmt::format("{}", fmt::join(unused, ", ")));
}

}  // namespace

ImportedClip ReadHandAlone(const Fields& fields, const HandFieldNames& names, Side side, bool flat,
                           const ParameterOptions& options) {
  ImportedClip imported;
  Clip& clip = imported.clip;
  const DataValue pose = fields[names.pose], orient = fields[names.orient];
  const auto trans = fields.Find(names.trans);
  if (trans) clip.trans = ReadFrameRows(*trans, 3);
  const Eigen::Index told = clip.trans.cols();
  FingerAngles fingers(options);
  const Eigen::MatrixXd finger_rows = fingers.Read(pose, side, imported, told);
  const Eigen::MatrixXd root_rows =
      ReadRotations(orient, 1, imported, told > 0 ? told : finger_rows.cols());
  const Eigen::Index frames = std::max({told, finger_rows.cols(), root_rows.cols()});
  clip.pose = RestPoses(frames, pose, NumbersPerHand(pose, told));
  SetJoints(clip.pose, 0, root_rows, orient.Where());
  SetJoints(clip.pose, HandBegin(side), finger_rows, pose.Where());
  if (!trans) {
    clip.trans.setZero(3, frames);
    imported.notes.push_back("warning: no translation of the hand in the file: zero taken");
  } else if (told == 1) {
    clip.trans = clip.trans.replicate(1, frames).eval();
  } else {
    RequireFrames(fields.Where(), *fields.FirstOf(names.trans), told, frames);
  }
  if (!flat) fingers.AddMean(clip.pose);
  if (const auto betas = fields.Find(names.betas); betas && betas->HoldsNumbers()) {
    SetBetas(ReadBetas(*betas), imported);
  }
  clip.surface_model_type = "mano";
  Append(imported.conventions, fingers.Conventions());
  Append(imported.notes, fingers.Notes());
  return imported;
}

bool LooksLikeMano(const Fields& fields) { return FindHand(fields).has_value(); }

ImportedClip ImportMano(const Fields& packed, const std::filesystem::path& path,
                        const ParameterOptions& options) {
  const Fields fields = *FindHand(packed);
  ImportedClip told;
  const Side side = SideOf(fields.FirstOf(kIsRight) ? fields : packed, options, told);
  const bool flat = options.flat_hand_mean.value_or(FlatHandMeanOf(fields).value_or(false));
  ImportedClip imported = ReadHandAlone(
      fields, {"global_orient", "hand_pose", kHandTrans, kHandBetas}, side, flat, options);
  imported.format = fmt::format("MANO parameters of a {} hand", SideName(side));
  Append(imported.notes, told.notes);
  SettleFrameRate(packed, options, 30, imported);
  if (const auto gender = fields.Find("gender")) {
    if (const auto known = GenderOf(*gender)) imported.clip.gender = *known;
  }
  ListUnusedOfHand(packed, fields, imported);
  AddObjectBeside(path, options, imported);
  SettleWorld(imported, options, WorldUp::kPlusZ, false);
  return imported;
}

}  // namespace holdfast
