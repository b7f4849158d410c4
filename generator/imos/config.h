// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <vector>

#include "generator/imos/vocabulary.h"

namespace holdfast::imos {

inline constexpr int kHistory = 4;        ///< k: past key frames given to the networks
inline constexpr int kNumKeyFrames = 15;  ///< T of the published protocol; the first k are given
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

/// Progress of a motion at key frame t of the published protocol: 0 in the first, 1 from the last
/// on.
constexpr double ProgressOf(int frame) {
  return frame < kNumKeyFrames - 1 ? static_cast<double>(frame) / (kNumKeyFrames - 1) : 1.0;
}

/// Two: arms by Arm Synthesis, then the trunk by Body Synthesis. One (the paper's third ablation):
/// all 22 joints by Body Synthesis.
enum class Modules { kTwo, kOne };
/// Source of action embeddings. kGiven: external, in the published system from CLIP's text encoder;
/// kLearned: a table trained with the networks; kRandom: a table of fixed draws of N(0, 1), the
/// paper's first ablation.
enum class ActionEmbedding { kGiven, kLearned, kRandom };
/// Part of each past object pose given to Arm Synthesis: only the translation (code), or
/// translation and rotation (paper).
enum class ArmsObject { kTranslation, kPose };
/// Additional object input of Body Synthesis besides the past k poses: none (paper), or one more
/// pose, which at run time is always that of the previous frame. In training, kTrue uses the true
/// pose at t (code), and kPrevious the same as at run time.
enum class ObjectInput { kAbsent, kPrevious, kTrue };
/// Order of the joints of Arm Synthesis: 16, 17, .., 21, or 17, 19, 21, 16, 18, 20 as in the
/// published weights. Body Synthesis always uses ascending order.
enum class ArmOrder { kAscending, kRightThenLeft };
/// Root translation: given with every frame (code), or predicted by Body Synthesis, which then has
/// the past k as input and 3 more outputs: the step from the previous key frame, meters.
enum class RootTranslation { kGiven, kPredicted };
/// Pose output of Body Synthesis: the pose itself (code), or its step from the previous key frame
/// in 6D, as in Arm Synthesis. With steps, people keep their stance, including people not seen in
/// training.
enum class BodyMakes { kPose, kStep };
/// Past poses given to Body Synthesis with self-attention: the output of attention instead of the
/// poses (paper), or both. The last step of attention is a layer norm over the whole pose, which
/// removes the scale of its values.
enum class AttentionInput { kReplace, kConcat };
/// Object rotation given to the networks: R of x = R x_object + T, or its transpose, as in GRAB and
/// the published weights (whose points are rows).
enum class ObjectRotation { kColumns, kRows };

/// Everything that determines the tensors and their use. PaperConfig() is the published code; other
/// values of the options are the paper's text, its ablations, or our own.
struct Config {
  Modules modules = Modules::kTwo;
  bool self_attention = true;  ///< false: second ablation, past poses unchanged
  AttentionInput attended_past = AttentionInput::kReplace;
  /// Encoders and decoders receive the progress t / 14, at most 1, since four past key frames do
  /// not distinguish a first bite from a last one. Not in the published system.
  bool sees_progress = false;
  ActionEmbedding action_embedding = ActionEmbedding::kGiven;
  int action_size = 512;        ///< E
  bool arms_see_class = false;  ///< the object's one-hot in the arms' condition (paper)
  ArmsObject arms_object = ArmsObject::kTranslation;
  bool body_sees_arms_now = true;  ///< arms of frame t, just generated (code), or not (paper)
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
  /// Joints generated by Body Synthesis: 0..15, or 0..21.
  int BodyJoints() const { return HasArms() ? kNumTrunkJoints : kNumPoseJoints; }
  int BodyPoseSize() const { return BodyJoints() * kRotationSize; }
  /// Whether Body Synthesis receives past poses unchanged.
  bool SeesPastPoses() const { return !self_attention || attended_past == AttentionInput::kConcat; }
  /// Size of a past pose in the input of Body Synthesis.
  int BodyPastPoseSize() const {
    return ((self_attention ? 1 : 0) + (SeesPastPoses() ? 1 : 0)) * BodyPoseSize();
  }
  int ProgressSize() const { return sees_progress ? 1 : 0; }
  int ArmsObjectSize() const { return arms_object == ArmsObject::kPose ? kObjectSize : 3; }
  /// Random numbers of one step of one sample: first those of the arms, then of the body.
  int NoiseSize() const { return (HasArms() ? arms_latent : 0) + body_latent; }

  // Input sizes of the networks, with their parts in order. Past quantities are frame by frame,
  // oldest first: [t-4 | t-3 | t-2 | t-1].
  /// betas 10, object one-hot 54 if arms_see_class, action E
  int ArmsConditionInput() const;
  /// arms of frame t 36, object of frame t, phi: training only
  int ArmsPresentInput() const;
  /// past arms 4 x 36, past objects 4 x (3 or 9), progress 1 if used, phi
  int ArmsPastInput() const;
  /// phi, latent, past arms, past objects, progress
  int ArmsDecoderInput() const;
  /// betas 10, object one-hot 54, action E
  int BodyConditionInput() const;
  /// past poses 4 x BodyPoseSize(), attended, then 4 x unchanged if kConcat; with two modules past
  /// arms 4 x 36 and, if body_sees_arms_now, arms of frame t 36; object "now" 9 unless absent; past
  /// objects 4 x 9; past root translations 4 x 3 if predicted; progress 1 if used; phi
  int BodyPastInput() const;
  /// latent, then the input of the past encoder before its normalization
  int BodyDecoderInput() const;
  /// BodyPoseSize(), and 3 more with a predicted root
  int BodyOutput() const;

  friend bool operator==(const Config&, const Config&) = default;
};

/// The published code and sizes: 22.0 M parameters for the arms (12.9 M without the present
/// encoder), 2.8 M for the body.
Config PaperConfig();
/// Our configuration: the same graph with narrower layers, a learned embedding of size 32, the
/// object's class and full pose given to the arms, pose steps, and a predicted root. 2.8 M
/// parameters without the present encoder.
Config CompactConfig();

/// Throws Error naming the option if a size is not in 1..65536, or attention has more than 64
/// layers or 65536 rows.
void CheckConfig(const Config& config, const std::string& where);

/// Returns the metadata of a weights file: "modules": "two", "action_size": "512", ...
std::map<std::string, std::string> ConfigTexts(const Config& config);
/// Inverse; removes the texts it reads from `texts`. Throws Error for missing or unknown values.
Config ConfigFromTexts(std::map<std::string, std::string>& texts, const std::string& where);

/// A tensor of a weights file in PyTorch's layout (a linear layer is out x in).
struct TensorShape {
  std::string name;
  std::vector<std::size_t> shape;
};

/// Returns all tensors of a file of that configuration, in order of evaluation. `training` adds the
/// arms' present encoder (enc_bn1, enc_rb1, enc_rb2, mu_present, sigma_present), which is not used
/// at run time. Names are those of the published PyTorch modules after `arms.` and `body.`:
///   <module>.enc_bn0                    BatchNorm of the condition  .weight .bias .running_mean
///   <module>.enc_rb0                    block: condition -> phi                   .running_var
///   <module>.enc_bn1_past, enc_rb1_past, enc_rb2_past    past encoder
///   <module>.mu_past, sigma_past        linear .weight .bias
///   <module>.dec_bn1, dec_rb1, dec_rb2  decoder
///   body.attention_model.attention_layers.<l>.attn.w_qs|w_ks|w_vs|w_combine.weight
///   body.attention_model.attention_layers.<l>.attn.layer_norm.weight|bias   (joints x 6)
///   action_embedding.weight             (29 x E): optional if embeddings are external
/// A block has fc1, bn1, fc2, bn2, and fc3 if its input and output differ in size.
std::vector<TensorShape> TensorsOf(const Config& config, bool training);

}  // namespace holdfast::imos
