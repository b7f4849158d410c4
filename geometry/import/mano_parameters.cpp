// SPDX-License-Identifier: MIT
#include "geometry/import/mano_parameters.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/hand_evidence.h"
#include "geometry/conventions/loose_motion.h"
#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/fields.h"
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
      continue;  // not a dict
    }
  }
  return std::nullopt;
}

// Side that the file states, if any.
std::optional<Side> ToldSide(const Fields& fields, ImportedClip& imported) {
  const auto name = fields.FirstOf(kIsRight);
  if (!name) return std::nullopt;
  const DataValue value = fields[*name];
  if (!value.HoldsNumbers()) return std::nullopt;
  const std::vector<double> right = value.Array().AsDoubles();
  if (right.empty()) return std::nullopt;
  if (std::ranges::any_of(right, [&](double r) { return (r != 0) != (right[0] != 0); })) {
    throw Error(value.Where(), "has both hands in one motion", "Give one file per hand");
  }
  if (right[0] != 0) return Side::kRight;
  if (*name != "is_rhand") {
    imported.notes.push_back(
        fmt::format("warning: {} is 0: imported as a left hand. HaMeR stores a left hand as a "
                    "mirrored right hand: if this is HaMeR's own output, mirror it first",
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
                fmt::format("asks for a {} hand, but {} is a {} hand", SideName(*of_options),
                            options.body->Name(), SideName(*model)),
                "Omit --hands, or give the other hand's model");
  }
  const bool asked = of_options.has_value();
  const Side wanted = of_options.value_or(Side::kRight);
  if (const std::optional<Side> told = ToldSide(fields, imported)) {
    if (asked && *told != wanted) {
      throw Error(fields.Where(),
                  fmt::format("is of a {} hand, but a {} hand was requested", SideName(*told),
                              SideName(wanted)),
                  fmt::format("Give --hands {0}hand, or the body model of a {1} hand",
                              *told == Side::kRight ? 'r' : 'l', SideName(*told)));
    }
    return *told;
  }
  if (!asked) {
    imported.notes.push_back(
        "the file does not state which hand it is: assuming the right hand (--hands lhand "
        "overrides this)");
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
    imported.notes.push_back("warning: no translation of the hand in the file: zero is used");
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
  SettleWorld(imported, options, UpAxis::kZ, false);
  return imported;
}

namespace {

constexpr int kFingers = kJointsPerHand;

int RowOf(Side side) { return side == Side::kRight ? 0 : 1; }

Side SideOfName(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (name.find("left") != std::string::npos) return Side::kLeft;
  if (name.find("right") != std::string::npos) return Side::kRight;
  throw Error(path.string(),
              "holds the components of one hand, but its name does not show which one",
              "Name it MANO_LEFT or MANO_RIGHT, as it was downloaded");
}

}  // namespace

FingerAngles::FingerAngles(const ParameterOptions& options) : body_(options.body) {
  for (const std::filesystem::path& path : options.hand_models) Load(path);
}

void FingerAngles::Load(const std::filesystem::path& path) {
  const DataFile file(path);
  const Fields fields(file);
  const auto load = [&](Side side, std::string_view components, std::string_view mean) {
    const DataValue rows = fields[components];
    rows.Array().RequireShape({-1, kHandDofs});
    spaces_[RowOf(side)] = HandSpace{ReadFrameRows(rows, kHandDofs).transpose(),
                                     ReadFrameRows(fields[mean], kHandDofs).col(0)};
  };
  if (fields.Has("hands_componentsl") && fields.Has("hands_componentsr")) {
    load(Side::kLeft, "hands_componentsl", "hands_meanl");
    load(Side::kRight, "hands_componentsr", "hands_meanr");
  } else if (fields.Has("hands_components")) {
    load(SideOfName(path), "hands_components", "hands_mean");
  } else {
    throw Error(path.string(), "has no hands_components",
                "Give SMPLX_*.npz, SMPLX_*.pkl, or MANO_LEFT.pkl and MANO_RIGHT.pkl");
  }
}

Eigen::MatrixXd FingerAngles::Read(const DataValue& value, Side side, ImportedClip& imported,
                                   Eigen::Index frames) {
  const int numbers = NumbersPerHand(value, frames);
  if (numbers > kHandDofs) {
    matrices_ = true;
    return ReadRotations(value, kFingers, imported, frames);
  }
  if (numbers == kHandDofs) {
    return OfAngles(ReadRotations(value, kFingers, imported, frames), side);
  }
  return OfCoefficients(ReadFrameRows(value, numbers), side, value.Where());
}

Eigen::MatrixXd FingerAngles::OfAngles(const Eigen::MatrixXd& rows, Side side) {
  lacks_mean_[RowOf(side)] = true;
  angles_ = true;
  return rows;
}

Eigen::MatrixXd FingerAngles::OfCoefficients(const Eigen::MatrixXd& rows, Side side,
                                             const std::string& where) {
  lacks_mean_[RowOf(side)] = true;
  const std::optional<HandSpace>& space = spaces_[RowOf(side)];
  if (!space) {
    throw Error(where,
                fmt::format("holds {} coefficients of the {} hand's principal components, which "
                            "are stored only in the body model",
                            rows.rows(), SideName(side)),
                "Give that model with --hand-model SMPLX_NEUTRAL.npz (or MANO_LEFT.pkl and "
                "MANO_RIGHT.pkl), or ignore the fingers with --hands none");
  }
  if (rows.rows() > space->components.rows()) {
    throw Error(where,
                fmt::format("holds {} coefficients, the model has {} components", rows.rows(),
                            space->components.rows()),
                "Give the model that the file was made with");
  }
  coefficients_ = std::max(coefficients_, static_cast<int>(rows.rows()));
  return space->components.topRows(rows.rows()).transpose() * rows;
}

void FingerAngles::AddMean(std::vector<JointPose>& pose) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (!lacks_mean_[RowOf(side)]) continue;
    const std::optional<HandSpace>& space = spaces_[RowOf(side)];
    const Eigen::Matrix<double, kHandDofs, 1> mean = space ? space->mean : body_->HandMean(side);
    mean_of_body_ = mean_of_body_ || !space;
    mean_added_ = true;
    for (JointPose& p : pose) {
      p.middleCols<kFingers>(HandBegin(side)) += mean.reshaped<Eigen::ColMajor>(3, kFingers);
    }
  }
}

std::vector<std::string> FingerAngles::Conventions() const {
  std::vector<std::string> texts;
  if (matrices_) texts.push_back("fingers are stored as complete rotations (no mean hand to add)");
  const char* mean = mean_added_ ? "differences from the mean hand, which was added"
                                 : "complete (flat_hand_mean = True)";
  if (coefficients_ > 0) {
    texts.push_back(fmt::format("fingers are {} principal components per hand, {}", coefficients_,
                                mean_added_ ? "on top of the mean hand" : "without a mean hand"));
  }
  if (angles_) texts.push_back(fmt::format("finger angles are {}", mean));
  return texts;
}

std::vector<std::string> FingerAngles::Notes() const {
  if (!mean_of_body_ || body_->LoneHand() || body_->Name().starts_with("SMPLX_")) return {};
  return {
      fmt::format("the mean hand of {} was added, which only approximates SMPL-X's (give SMPL-X's "
                  "with --hand-model SMPLX_NEUTRAL.npz)",
                  body_->Name())};
}

int NumbersPerHand(const DataValue& value, Eigen::Index frames) {
  const NpyMember member = value.Array();
  std::vector<std::size_t> shape = member.array.shape;
  std::erase(shape, std::size_t{1});
  const std::optional<int> numbers = NumbersPerRotation(member, kFingers, frames);
  // (15, 6): one frame of 15 rotations, or 15 frames of 6 coefficients.
  const bool coefficients = shape.size() == 2 && frames == kFingers &&
                            shape[0] == std::size_t{kFingers} && shape[1] < std::size_t{kFingers};
  if (numbers && !coefficients) return *numbers * kFingers;
  if (member.array.NumElements() == 0 || shape.size() > 2 ||
      (!shape.empty() && shape.back() > kHandDofs)) {
    throw Error(value.Where(),
                fmt::format("has shape {}, which is not that of a hand", member.ShapeText()),
                "Give angles (frames, 45), matrices (frames, 15, 3, 3), or the coefficients of up "
                "to 45 principal components (frames, n)");
  }
  const bool one_number = shape.empty() || (shape.size() == 1 && member.array.shape.back() == 1);
  return one_number ? 1 : static_cast<int>(shape.back());
}

std::optional<bool> FingersLookFlat(const Clip& clip, const BodyModel& body) {
  Clip wrapped;
  wrapped.trans = clip.trans;
  wrapped.pose = clip.pose;
  WrapJointAngles(wrapped);
  const HandMeanEvidence evidence = JudgeHandMean(LooseMotionOf(wrapped), body);
  using Reading = HandMeanEvidence::Reading;
  if (!evidence.certain) return std::nullopt;
  if (evidence.reading == Reading::kFull) return true;
  if (evidence.reading == Reading::kRelative) return false;
  return std::nullopt;
}

}  // namespace holdfast
