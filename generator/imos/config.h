// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <vector>

#include "generator/imos/vocabulary.h"

namespace holdfast::imos {

inline constexpr int kHistory = 4;        ///< k: past key frames that the networks see
inline constexpr int kNumKeyFrames = 15;  ///< T of the published protocol, the first k given
inline constexpr int kNumBetas = 10;
inline constexpr int kRotationSize = 6;     ///< the first two rows of R, flattened
inline constexpr int kNumArmJoints = 6;     ///< SMPL-X 16..21: shoulders, elbows, wrists
inline constexpr int kNumTrunkJoints = 16;  ///< SMPL-X 0..15
inline constexpr int kNumPoseJoints = 22;   ///< SMPL-X 0..21
inline constexpr int kPoseSize = kNumPoseJoints * kRotationSize;    ///< 132
inline constexpr int kArmsSize = kNumArmJoints * kRotationSize;     ///< 36
inline constexpr int kTrunkSize = kNumTrunkJoints * kRotationSize;  ///< 96
inline constexpr int kObjectSize = 9;                               ///< translation 3, rotation 6

inline constexpr const char* kWeightsRemedy =
    "Give weights that 'holdfast.train imos' or import-weights wrote";

/// How far a motion is at key frame t of the published protocol's: 0 in the first, 1 from the last
/// one on.
constexpr double ProgressOf(int frame) {
  return frame < kNumKeyFrames - 1 ? static_cast<double>(frame) / (kNumKeyFrames - 1) : 1.0;
}

/// Two: arms by Arm Synthesis, then the trunk by Body Synthesis. One (the paper's third ablation):
/// all 22 joints by Body Synthesis.
enum class Modules { kTwo, kOne };
/// Where an action's embedding comes from. kGiven: from outside, of CLIP's text encoder in the
/// published system; kLearned: a table trained with the networks; kRandom: a table of fixed draws
/// of N(0, 1), the paper's first ablation.
enum class ActionEmbedding { kGiven, kLearned, kRandom };
/// What Arm Synthesis sees of each past object pose: the code gives the translation alone, the
/// paper says both.
enum class ArmsObject { kTranslation, kPose };
/// What Body Synthesis sees of the object besides the past k poses: nothing (the paper), or one
/// more pose, when running always that of the frame before. kTrue trains on the true pose at t (the
/// code), kPrevious on the same that running has.
enum class ObjectInput { kAbsent, kPrevious, kTrue };
/// In which order Arm Synthesis takes and gives joints: 16, 17, .., 21, or 17, 19, 21, 16, 18, 20
/// as in the published weights. Body Synthesis always has them ascending.
enum class ArmOrder { kAscending, kRightThenLeft };
/// The root's translation: given with every frame (the code), or predicted by Body Synthesis: it
/// sees the past k, and 3 more outputs are the step from the previous key frame, meters.
enum class RootTranslation { kGiven, kPredicted };
/// What Body Synthesis makes of the pose: the pose itself (the code), or its step from the previous
/// key frame in 6D, as Arm Synthesis does: then people stand as they stood, also those it never
/// saw.
enum class BodyMakes { kPose, kStep };
/// What Body Synthesis sees of past poses where there is self-attention: what that makes of them
/// instead of them (the paper), or beside them. A layer norm over the whole pose is attention's
/// last step, and takes away how large its numbers are.
enum class AttentionInput { kReplace, kConcat };
/// Which rotation of the object the networks see: R of x = R x_object + T, or its transpose, as
/// GRAB and the published weights have it (their points are rows).
enum class ObjectRotation { kColumns, kRows };

/// Everything that decides which tensors there are and how they are used. PaperConfig() is the
/// published code; each option's other values are the paper's text, its ablations, or ours.
struct Config {
  Modules modules = Modules::kTwo;
  bool self_attention = true;  ///< false: the second ablation, past poses as they are
  AttentionInput attended_past = AttentionInput::kReplace;
  /// Encoders and decoders see how far the motion is, t / 14, at most 1: four past key frames
  /// cannot tell a first bite from a last one. Not in the published system.
  bool sees_progress = false;
  ActionEmbedding action_embedding = ActionEmbedding::kGiven;
  int action_size = 512;        ///< E
  bool arms_see_class = false;  ///< the object's one-hot in the arms' condition (the paper)
  ArmsObject arms_object = ArmsObject::kTranslation;
  bool body_sees_arms_now = true;  ///< the arms of frame t, just made (the code), or not (paper)
  ObjectInput object_now = ObjectInput::kTrue;
  ArmOrder arm_order = ArmOrder::kAscending;
  RootTranslation root = RootTranslation::kGiven;
  BodyMakes body_makes = BodyMakes::kPose;
  ObjectRotation object_rotation = ObjectRotation::kRows;

  // Widths. A block is in -> block_width -> out.
  int block_width = 256;
  int arms_condition = 400;  ///< phi of the arms
  int arms_first = 4096;     ///< encoders, first block
  int arms_second = 1024;    ///< encoders, second block
  int arms_decoder = 2048;
  int arms_latent = 32;
  int body_condition = 70;  ///< phi of the body
  int body_first = 500;
  int body_second = 250;
  int body_decoder = 500;
  int body_latent = 100;
  int attention_layers = 4;
  int attention_heads = 4;
  int attention_width = 16;  ///< d_k = d_v of one head

  bool HasArms() const { return modules == Modules::kTwo; }
  /// Joints that Body Synthesis makes: 0..15, or 0..21.
  int BodyJoints() const { return HasArms() ? kNumTrunkJoints : kNumPoseJoints; }
  int BodyPoseSize() const { return BodyJoints() * kRotationSize; }
  /// Whether Body Synthesis sees past poses as they are.
  bool SeesPastPoses() const { return !self_attention || attended_past == AttentionInput::kConcat; }
  /// Numbers of a past pose as Body Synthesis sees it.
  int BodyPastPoseSize() const {
    return ((self_attention ? 1 : 0) + (SeesPastPoses() ? 1 : 0)) * BodyPoseSize();
  }
  int ProgressSize() const { return sees_progress ? 1 : 0; }
  int ArmsObjectSize() const { return arms_object == ArmsObject::kPose ? kObjectSize : 3; }
  /// Random numbers of one step of one sample: the arms' first, then the body's.
  int NoiseSize() const { return (HasArms() ? arms_latent : 0) + body_latent; }

  // Sizes of the networks' inputs, with what they are put together from, in this order. Past things
  // are frame by frame, the oldest first: [t-4 | t-3 | t-2 | t-1].
  /// betas 10, object one-hot 54 if arms_see_class, action E
  int ArmsConditionInput() const;
  /// arms of frame t 36, object of frame t, phi: training only
  int ArmsPresentInput() const;
  /// past arms 4 x 36, past objects 4 x (3 or 9), progress 1 if seen, phi
  int ArmsPastInput() const;
  /// phi, latent, past arms, past objects, progress
  int ArmsDecoderInput() const;
  /// betas 10, object one-hot 54, action E
  int BodyConditionInput() const;
  /// past poses 4 x BodyPoseSize(), attended, and then 4 x as they are if beside; with two modules
  /// past arms 4 x 36 and, if body_sees_arms_now, arms of frame t 36; object "now" 9 unless absent;
  /// past objects 4 x 9; past root translations 4 x 3 if predicted; progress 1 if seen; phi
  int BodyPastInput() const;
  /// latent, then the past encoder's input before its normalization
  int BodyDecoderInput() const;
  /// BodyPoseSize(), and 3 more with a predicted root
  int BodyOutput() const;

  friend bool operator==(const Config&, const Config&) = default;
};

/// The published code and sizes: 22.0 M numbers for the arms (12.9 M without the present encoder),
/// 2.8 M for the body.
Config PaperConfig();
/// Ours: the same graph with narrower layers, a learned embedding of 32, the object's class and
/// whole pose seen by the arms, steps of the pose, and the root predicted: 2.8 M numbers without
/// the present encoder.
Config CompactConfig();

/// Throws Error naming the option when a size is not in 1..65536, or attention has more than 64
/// layers or 65536 rows.
void CheckConfig(const Config& config, const std::string& where);

/// As texts of a weights file: "modules": "two", "action_size": "512", ...
std::map<std::string, std::string> ConfigTexts(const Config& config);
/// The inverse; takes what it reads out of `texts`. Throws Error for what is missing or unknown.
Config ConfigFromTexts(std::map<std::string, std::string>& texts, const std::string& where);

/// A tensor of a weights file, PyTorch's layout (a linear layer is out x in).
struct TensorShape {
  std::string name;
  std::vector<std::size_t> shape;
};

/// All tensors of a file of that configuration, in order of evaluation. `training` adds the arms'
/// present encoder (enc_bn1, enc_rb1, enc_rb2, mu_present, sigma_present), which running does not
/// use. Names are those of the published PyTorch modules behind `arms.` and `body.`:
///   <module>.enc_bn0                    BatchNorm of the condition  .weight .bias .running_mean
///   <module>.enc_rb0                    block: condition -> phi                   .running_var
///   <module>.enc_bn1_past, enc_rb1_past, enc_rb2_past    past encoder
///   <module>.mu_past, sigma_past        linear .weight .bias
///   <module>.dec_bn1, dec_rb1, dec_rb2  decoder
///   body.attention_model.attention_layers.<l>.attn.w_qs|w_ks|w_vs|w_combine.weight
///   body.attention_model.attention_layers.<l>.attn.layer_norm.weight|bias   (joints x 6)
///   action_embedding.weight             (29 x E): unless given from outside, where it may be left
///   out
/// A block has fc1, bn1, fc2, bn2, and fc3 where its input and output differ in size.
std::vector<TensorShape> TensorsOf(const Config& config, bool training);

}  // namespace holdfast::imos
