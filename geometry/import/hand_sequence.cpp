// SPDX-License-Identifier: MIT
#include "geometry/import/hand_sequence.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/body/default_hand.h"
#include "geometry/error.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/world_frame.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

void FillGaps(HandSequence& sequence) {
  if (std::ranges::none_of(sequence.frames, [](const auto& frame) { return frame.has_value(); })) {
    throw Error(
        sequence.path.string(), fmt::format("has no frame with a {} hand", SideName(sequence.side)),
        "Give frames in which the hand was annotated, or choose the other one with --hands");
  }
  std::vector<std::size_t> without = FillWithNearest(sequence.frames);
  if (without.empty()) return;
  constexpr std::size_t kMaxNamed = 8;
  const std::size_t count = without.size();
  without.resize(std::min(count, kMaxNamed));
  sequence.imported.notes.push_back(fmt::format(
      "warning: no hand in {} of {} frames ({}{}): the nearest hand is kept there", count,
      sequence.frames.size(), fmt::join(without, ", "), count > kMaxNamed ? ", ..." : ""));
}

// Fingers (45 x T), without the mean hand.
Eigen::MatrixXd FingersOfFrames(const HandSequence& sequence, const ParameterOptions& options,
                                FingerAngles& fingers) {
  const auto frames = static_cast<Eigen::Index>(sequence.frames.size());
  if (options.hands == ImportedHands::kNone) {
    return fingers.OfAngles(Eigen::MatrixXd::Zero(kHandDofs, frames), sequence.side);
  }
  const Eigen::Index numbers = sequence.frames[0]->fingers.size();
  Eigen::MatrixXd rows(numbers, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const Eigen::VectorXd& own = sequence.frames[t]->fingers;
    if (own.size() != numbers) {
      throw Error(sequence.path.string(),
                  fmt::format("has {} numbers for the fingers in frame {}, {} in the first",
                              own.size(), t, numbers),
                  "Give the frames of one sequence");
    }
    rows.col(t) = own;
  }
  return sequence.layout.coefficients
             ? fingers.OfCoefficients(rows, sequence.side, sequence.path.string())
             : fingers.OfAngles(rows, sequence.side);
}

}  // namespace

std::optional<Side> WantedHand(const ParameterOptions& options) {
  if (options.hands == ImportedHands::kLeftAlone) return Side::kLeft;
  if (options.hands == ImportedHands::kRightAlone) return Side::kRight;
  return options.body->LoneHand();
}

Side ChooseHand(bool has_right, bool has_left, const ParameterOptions& options,
                ImportedClip& imported) {
  const Side side = WantedHand(options).value_or(has_right ? Side::kRight : Side::kLeft);
  if (has_right && has_left) {
    imported.notes.push_back(fmt::format(
        "the file has both hands: the {} one is used (--hands rhand or lhand)", SideName(side)));
  }
  return side;
}

void TakeBetas(const Fields& fields, std::string_view name, HandSequence& sequence) {
  const auto value = fields.Find(name);
  if (!value || !value->HoldsNumbers() || sequence.betas.size() > 0) return;
  const Eigen::MatrixXd betas = ReadBetas(*value);
  if (betas.cols() > 0) sequence.betas = betas.rowwise().mean();
}

bool ChooseObjectOfHand(std::vector<SceneObject> objects, const ParameterOptions& options,
                        HandSequence& sequence) {
  Eigen::Matrix3Xd hand = Eigen::Matrix3Xd::Zero(3, std::ssize(sequence.frames));
  for (Eigen::Index t = 0; t < hand.cols(); ++t) {
    const std::optional<HandFrame>& frame = sequence.frames[t];
    hand.col(t) =
        frame ? frame->trans : Eigen::Vector3d(hand.col(std::max<Eigen::Index>(t - 1, 0)));
  }
  const std::optional<SceneObject> object =
      ChooseObject(std::move(objects), {&hand, 1}, options.prop, sequence.path.string(),
                   sequence.imported.notes);
  if (!object) return false;
  sequence.object_name = object->name;
  for (const auto& pose : object->poses) sequence.object.push_back(*pose);
  return true;
}

ImportedClip ClipOfHand(HandSequence sequence, const ParameterOptions& options) {
  FillGaps(sequence);
  const HandLayout& layout = sequence.layout;
  const Side side = sequence.side;
  ImportedClip& imported = sequence.imported;
  Clip& clip = imported.clip;
  const auto frames = static_cast<Eigen::Index>(sequence.frames.size());
  clip.surface_model_type = "mano";
  clip.pose.assign(sequence.frames.size(), JointPose::Zero());
  clip.trans.resize(3, frames);
  if (sequence.betas.size() > 0) SetBetas(sequence.betas, imported);

  FingerAngles fingers(options);
  SetJoints(clip.pose, HandBegin(side), FingersOfFrames(sequence, options, fingers),
            sequence.path.string());
  const bool complete = options.flat_hand_mean.value_or(!layout.coefficients);
  if (!complete || options.hands == ImportedHands::kNone) fingers.AddMean(clip.pose);

  const Eigen::Vector3d wrist =
      PelvisOf(clip, options.body->LoneHand() ? *options.body : *DefaultHand(side));
  for (Eigen::Index t = 0; t < frames; ++t) {
    const HandFrame& frame = *sequence.frames[t];
    clip.pose[t].col(0) = frame.orient;
    clip.trans.col(t) = frame.trans;
    if (layout.root == HandRoot::kWristPlaced) clip.trans.col(t) -= wrist;
    if (layout.root == HandRoot::kOrigin) clip.trans.col(t) += ExpSO3(frame.turn) * wrist - wrist;
  }
  if (!sequence.object.empty()) {
    if (sequence.object.size() == 1)
      sequence.object.resize(sequence.frames.size(), sequence.object[0]);
    RequireFrames(sequence.path.string(), "the object", std::ssize(sequence.object), frames);
    imported.object_mesh_scale = sequence.mesh_scale;
    PutObject({sequence.object_name, {sequence.object.begin(), sequence.object.end()}},
              sequence.path, sequence.meshes, options, imported);
  }
  imported.format = fmt::format("{}, {} hand", layout.name, SideName(side));
  imported.conventions.push_back(fmt::format("positions are in {}", layout.world));
  Append(imported.conventions, fingers.Conventions());
  Append(imported.notes, fingers.Notes());
  const std::optional<double> rate =
      options.source_frame_rate ? options.source_frame_rate : sequence.rate_hz;
  clip.frame_rate = rate.value_or(30.0);
  if (frames > 1 && !rate) {
    imported.notes.push_back(
        "warning: no frame rate in the file: assuming 30 Hz ('holdfast import --source-fps' "
        "overrides this)");
  }
  SettleWorld(imported, options, layout.up, false);
  return std::move(imported);
}

}  // namespace holdfast
