// SPDX-License-Identifier: MIT
#include "generator/training/imos/action_critic.h"

#include "generator/nn/network_weights.h"
#include "generator/training/imos/imos_kinematics.h"

namespace holdfast::imos {
namespace {

constexpr int kFrames = kNumKeyFrames - kHistory + 1;
constexpr int kFrameSize = 3 * kNumPoseJoints + kObjectSize;
constexpr int kMotionSize = (2 * kFrames - 1) * kFrameSize;
constexpr double kRate = 4e-4;
constexpr double kLever = 0.1;          // meters: what turns a point this far off by a blur
constexpr double kMinDeviation = 0.01;  // meters: what hardly moves is not blown up

torch::Tensor Unscaled(const std::vector<torch::Tensor>& frames) {
  std::vector<torch::Tensor> parts = frames;
  for (std::size_t t = 1; t < frames.size(); ++t) parts.push_back(frames[t] - frames[t - 1]);
  return torch::cat(parts, 1);
}

}  // namespace

ActionCritic::ActionCritic(const SequenceTensors& data, std::uint64_t seed)
    : LeastSquaresCritic(nn::RandomResidual(kMotionSize, 0, kWidth, kBlocks, kNumActions, seed),
                         kRate) {
  const torch::Tensor motions = Unscaled(TrueFrames(data));
  mean_ = motions.mean(0);
  deviation_ = motions.std(0).clamp_min(kMinDeviation);
  for (std::int64_t action = 0; action < kNumActions; ++action) {
    if (data.action.eq(action).any().item<bool>()) known_.push_back(action);
  }
}

torch::Tensor ActionCritic::Frame(const torch::Tensor& joints, const torch::Tensor& object_T,
                                  const torch::Tensor& object_R) {
  return torch::cat({joints.flatten(1), object_T, SixOf(object_R)}, 1);
}

std::vector<torch::Tensor> ActionCritic::TrueFrames(const SequenceTensors& batch) {
  std::vector<torch::Tensor> frames;
  for (int t = kHistory - 1; t < kNumKeyFrames; ++t) {
    frames.push_back(
        Frame(batch.joints.select(1, t), batch.object_T.select(1, t), batch.object_R.select(1, t)));
  }
  return frames;
}

std::vector<torch::Tensor> ActionCritic::Blurred(std::vector<torch::Tensor> frames, double blur_m,
                                                 at::Generator& generator) {
  if (blur_m <= 0.0) return frames;
  torch::Tensor deviation = torch::full({kFrameSize}, blur_m);
  deviation.narrow(0, kFrameSize - kRotationSize, kRotationSize).fill_(blur_m / kLever);
  for (torch::Tensor& frame : frames) {
    frame =
        frame + deviation * torch::randn(frame.sizes(), c10::optional<at::Generator>(generator));
  }
  return frames;
}

torch::Tensor ActionCritic::Motions(const std::vector<torch::Tensor>& frames) const {
  return (Unscaled(frames) - mean_) / deviation_;
}

torch::Tensor ActionCritic::Scores(const torch::Tensor& motions,
                                   const torch::Tensor& actions) const {
  return Network().Forward(motions).gather(1, actions.unsqueeze(1)).squeeze(1);
}

torch::Tensor ActionCritic::Doubt(const torch::Tensor& motions,
                                  const torch::Tensor& actions) const {
  return DoubtOfScores(Scores(motions, actions));
}

double ActionCritic::Learn(const torch::Tensor& true_motions, const torch::Tensor& own_motions,
                           const torch::Tensor& actions, at::Generator& generator) {
  const torch::Tensor real = true_motions.detach().clone().requires_grad_(true);
  const torch::Tensor real_score = Scores(real, actions);
  const torch::Tensor own_score = Scores(own_motions.detach(), actions);
  // Another of the data's actions for each.
  const auto count = static_cast<std::int64_t>(known_.size());
  torch::Tensor wrong_loss = torch::zeros({});
  if (count > 1) {
    const torch::Tensor drawn = torch::empty(actions.sizes(), torch::kInt64)
                                    .random_(0, count, c10::optional<at::Generator>(generator));
    const torch::Tensor wrong = torch::tensor(known_).index_select(0, drawn);
    const torch::Tensor is_wrong = wrong.ne(actions).to(torch::kFloat32);
    wrong_loss = (is_wrong * (Scores(real, wrong) + 1.0).square()).mean();
  }
  const torch::Tensor belief = 0.5 * (BeliefOfScores(own_score) + wrong_loss);
  return LearnToTell(real, real_score, own_score, belief);
}

}  // namespace holdfast::imos
