// SPDX-License-Identifier: MIT
#include "geometry/import/finger_angles.h"

#include <algorithm>

#include <fmt/format.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/hand_evidence.h"
#include "geometry/error.h"
#include "geometry/import/fields.h"
#include "geometry/import/rotation_arrays.h"

namespace holdfast {
namespace {

constexpr int kFingers = kJointsPerHand;

int RowOf(Side side) { return side == Side::kRight ? 0 : 1; }

// K components, one a row, as (K x 45).
Eigen::MatrixXd ReadComponents(const DataValue& value) {
  const NpyMember member = value.Array();
  member.RequireShape({-1, kHandDofs});
  return ReadFrameRows(value, kHandDofs).transpose();
}

Side SideOfName(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (name.find("left") != std::string::npos) return Side::kLeft;
  if (name.find("right") != std::string::npos) return Side::kRight;
  throw Error(path.string(), "holds the components of one hand, which one it does not tell",
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
    spaces_[RowOf(side)] = HandSpace{ReadComponents(fields[components]),
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
  lacks_mean_[RowOf(side)] = true;
  if (numbers == kHandDofs) {
    angles_ = true;
    return ReadRotations(value, kFingers, imported, frames);
  }
  const std::optional<HandSpace>& space = spaces_[RowOf(side)];
  if (!space) {
    throw Error(value.Where(),
                fmt::format("holds {} coefficients of the {} hand's principal components, which "
                            "only the body model has",
                            numbers, SideName(side)),
                "Give that model with --hand-model SMPLX_NEUTRAL.npz (or MANO_LEFT.pkl and "
                "MANO_RIGHT.pkl), or leave the fingers out with --hands none");
  }
  if (numbers > space->components.rows()) {
    throw Error(value.Where(),
                fmt::format("holds {} coefficients, the model has {} components", numbers,
                            space->components.rows()),
                "Give the model that the file was made with");
  }
  coefficients_ = std::max(coefficients_, numbers);
  return space->components.topRows(numbers).transpose() * ReadFrameRows(value, numbers);
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
  if (matrices_) texts.push_back("fingers are whole rotations, complete as they are");
  const char* mean = mean_added_ ? "differences from the mean hand, which was added"
                                 : "complete as they are (flat_hand_mean = True)";
  if (coefficients_ > 0) {
    texts.push_back(fmt::format("fingers are {} principal components a hand, {}", coefficients_,
                                mean_added_ ? "on top of the mean hand" : "without a mean hand"));
  }
  if (angles_) texts.push_back(fmt::format("finger angles are {}", mean));
  return texts;
}

std::vector<std::string> FingerAngles::Notes() const {
  if (!mean_of_body_ || body_->LoneHand() || body_->Name().starts_with("SMPLX_")) return {};
  return {
      fmt::format("the mean hand added is that of {}, which is near SMPL-X's but not it: "
                  "--hand-model SMPLX_NEUTRAL.npz gives the real one",
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
    throw Error(value.Where(), fmt::format("has shape {}, no hand's", member.ShapeText()),
                "Give angles (frames, 45), matrices (frames, 15, 3, 3), or the coefficients of up "
                "to 45 principal components (frames, n)");
  }
  const bool one_number = shape.empty() || (shape.size() == 1 && member.array.shape.back() == 1);
  return one_number ? 1 : static_cast<int>(shape.back());
}

std::optional<bool> FingersLookFlat(const Clip& clip, const BodyModel& body) {
  LooseMotion motion;
  motion.has_hands = true;
  motion.frames = clip.NumFrames();
  Clip wrapped;
  wrapped.pose = clip.pose;
  WrapJointAngles(wrapped);
  motion.pose = std::move(wrapped.pose);
  const HandMeanEvidence evidence = JudgeHandMean(motion, body);
  using Reading = HandMeanEvidence::Reading;
  if (!evidence.certain) return std::nullopt;
  if (evidence.reading == Reading::kFull) return true;
  if (evidence.reading == Reading::kRelative) return false;
  return std::nullopt;
}

}  // namespace holdfast
