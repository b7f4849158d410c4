// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_unroll.h"

#include <algorithm>

namespace holdfast::imos {
namespace {

constexpr std::int64_t kTrunk = kTrunkSize, kArms = kArmsSize;

torch::Tensor MeanL1(const torch::Tensor& a, const torch::Tensor& b) {
  return (a - b).abs().mean();
}

double Value(const torch::Tensor& scalar) { return scalar.detach().item<double>(); }

torch::Tensor Rotations(const torch::Tensor& pose) {
  return RotationsOf(pose.view({pose.size(0), kNumPoseJoints, kRotationSize}));
}

}  // namespace

Unroller::Unroller(const TorchNetworks& networks, const SequenceTensors& batch, int first,
                   double noise, Pass& pass, at::Generator& generator)
    : networks_(networks),
      config_(networks.Sizes()),
      batch_(batch),
      pass_(pass),
      generator_(generator),
      t_(first) {
  for (int t = first - kHistory; t < first; ++t) {
    TorchFrame frame = Truth(t);
    if (noise > 0.0) {
      const auto disturbed = [&](const torch::Tensor& x, double deviation) {
        return x + deviation * torch::empty_like(x).normal_(0.0, 1.0, generator_);
      };
      frame.pose = disturbed(frame.pose, noise);
      frame.object.T = disturbed(frame.object.T, noise / 3.0);
      frame.body = ForwardJoints(Rotations(frame.pose), frame.transl, batch_.bones);
    }
    history_.push_back(std::move(frame));
  }
  Refresh();
}

void Unroller::Refresh() {
  for (TorchFrame& frame : history_) frame.attended = torch::Tensor();
  const ConditionInput condition{batch_.betas, batch_.object_id, batch_.action};
  if (config_.HasArms()) arms_phi_ = networks_.ArmsCondition(condition, pass_);
  body_phi_ = networks_.BodyCondition(condition, pass_);
}

TorchFrame Unroller::Truth(int t) const {
  TorchFrame frame;
  frame.pose = batch_.pose.select(1, t);
  frame.transl = batch_.transl.select(1, t);
  frame.object = {batch_.object_T.select(1, t), batch_.object_R.select(1, t)};
  frame.body = ForwardJoints(Rotations(frame.pose), frame.transl, batch_.bones);
  return frame;
}

void Unroller::ForgetPredictions() {
  for (int k = 0; k < kHistory; ++k) history_[k] = Truth(t_ - kHistory + k);
}

torch::Tensor Unroller::ObjectNumbers(const TorchObject& object, bool rotation) const {
  if (!rotation) return object.T;
  const bool rows = config_.object_rotation == ObjectRotation::kRows;
  return torch::cat({object.T, SixOf(rows ? object.R.transpose(1, 2) : object.R)}, 1);
}

torch::Tensor Unroller::Past(const torch::Tensor TorchFrame::*part, std::int64_t begin,
                             std::int64_t size) const {
  std::vector<torch::Tensor> parts;
  for (const TorchFrame& frame : history_) parts.push_back((frame.*part).narrow(1, begin, size));
  return torch::cat(parts, 1);
}

torch::Tensor Unroller::Noise(const torch::Tensor& like, const StepOptions& options) {
  return options.sample ? torch::empty_like(like).normal_(0.0, 1.0, generator_)
                        : torch::zeros_like(like);
}

torch::Tensor Unroller::Progress() const {
  return torch::full({batch_.pose.size(0), 1}, ProgressOf(t_), batch_.pose.options());
}

torch::Tensor Unroller::ArmLatents(const torch::Tensor& input, const StepOptions& options) {
  const Latents from_past = networks_.ArmsPast(input, arms_phi_, pass_);
  divergence_arms_ = from_past.Divergence();
  const torch::Tensor z = from_past.Sample(Noise(from_past.mu, options));
  if (!(options.present_share > 0.0)) return z;
  const TorchFrame truth = Truth(t_);
  const bool with_rotation = config_.arms_object == ArmsObject::kPose;
  const Latents present =
      networks_.ArmsPresent(torch::cat({truth.pose.narrow(1, kTrunk, kArms),
                                        ObjectNumbers(truth.object, with_rotation), arms_phi_},
                                       1),
                            pass_);
  divergence_arms_ = divergence_arms_ + present.Divergence();
  const torch::Tensor chosen =
      torch::empty({batch_.pose.size(0), 1}).bernoulli_(options.present_share, generator_);
  return chosen * present.Sample(Noise(present.mu, options)) + (1.0 - chosen) * z;
}

void Unroller::PredictArms(const torch::Tensor& past, const StepOptions& options) {
  const bool with_rotation = config_.arms_object == ArmsObject::kPose;
  std::vector<torch::Tensor> parts{past};
  for (const TorchFrame& frame : history_) {
    parts.push_back(ObjectNumbers(frame.object, with_rotation));
  }
  if (config_.sees_progress) parts.push_back(Progress());
  const torch::Tensor input = torch::cat(parts, 1);
  const torch::Tensor z = ArmLatents(input, options);
  arms_ = history_.back().pose.narrow(1, kTrunk, kArms) +
          networks_.ArmsDecode(z, input, arms_phi_, pass_);
}

Unroller::SeenArms Unroller::ArmsSeen(const torch::Tensor& past, const StepOptions& options) const {
  if (!options.true_arms) return {past, config_.HasArms() ? arms_ : torch::Tensor()};
  std::vector<torch::Tensor> parts;
  for (int k = 0; k < kHistory; ++k) {
    parts.push_back(batch_.pose.select(1, t_ - kHistory + k).narrow(1, kTrunk, kArms));
  }
  return {torch::cat(parts, 1), batch_.pose.select(1, t_).narrow(1, kTrunk, kArms)};
}

torch::Tensor Unroller::BodyInput(const SeenArms& arms, const StepOptions& options) {
  std::vector<torch::Tensor> parts;
  for (TorchFrame& frame : history_) {
    if (!frame.attended.defined()) {
      frame.attended = networks_.Attend(frame.pose.narrow(1, 0, config_.BodyPoseSize()), pass_);
    }
    parts.push_back(frame.attended);
  }
  if (config_.self_attention && config_.SeesPastPoses()) {
    parts.push_back(Past(&TorchFrame::pose, 0, config_.BodyPoseSize()));
  }
  if (config_.HasArms()) {
    parts.push_back(arms.past);
    if (config_.body_sees_arms_now) parts.push_back(arms.now);
  }
  if (config_.object_now != ObjectInput::kAbsent) {
    const bool true_now = config_.object_now == ObjectInput::kTrue && options.true_object_now;
    parts.push_back(ObjectNumbers(true_now ? Truth(t_).object : history_.back().object, true));
  }
  for (const TorchFrame& frame : history_) parts.push_back(ObjectNumbers(frame.object, true));
  if (config_.root == RootTranslation::kPredicted) {
    parts.push_back(Past(&TorchFrame::transl, 0, 3));
  }
  if (config_.sees_progress) parts.push_back(Progress());
  parts.push_back(body_phi_);
  return torch::cat(parts, 1);
}

TorchFrame Unroller::Predict(const StepOptions& options) {
  const torch::Tensor past_arms = Past(&TorchFrame::pose, kTrunk, kArms);
  if (config_.HasArms()) PredictArms(past_arms, options);
  const SeenArms arms = ArmsSeen(past_arms, options);
  const torch::Tensor input = BodyInput(arms, options);
  const Latents latents = networks_.BodyPast(input, pass_);
  divergence_body_ = latents.Divergence();
  const torch::Tensor output =
      networks_.BodyDecode(latents.Sample(Noise(latents.mu, options)), input, pass_);

  const TorchFrame& last = history_.back();
  trunk_ = output.narrow(1, 0, config_.BodyPoseSize());
  if (config_.body_makes == BodyMakes::kStep) {
    trunk_ = trunk_ + last.pose.narrow(1, 0, config_.BodyPoseSize());
  }
  const bool predicts_root = config_.root == RootTranslation::kPredicted;
  TorchFrame frame;
  frame.pose = config_.HasArms() ? torch::cat({trunk_, arms_}, 1) : trunk_;
  root_step_ = predicts_root ? output.narrow(1, config_.BodyPoseSize(), 3) : torch::Tensor();
  frame.transl = predicts_root ? last.transl + root_step_ : batch_.transl.select(1, t_);
  // Apart, the body is not judged by what the arms do.
  const torch::Tensor posed =
      options.true_arms && config_.HasArms() ? torch::cat({trunk_, arms.now}, 1) : frame.pose;
  frame.body = ForwardJoints(Rotations(posed), frame.transl, batch_.bones);
  frame.object = Carried(last.object, last.body, frame.body, batch_.by_left.select(1, t_),
                         batch_.by_right.select(1, t_));
  return frame;
}

StepLosses Unroller::Judge(const TorchFrame& predicted, const LossWeights& weights) const {
  StepLosses out;
  const torch::Tensor truth = batch_.pose.select(1, t_), before = batch_.pose.select(1, t_ - 1);
  const torch::Tensor& last = history_.back().pose;
  // Of the modules' own outputs: the two losses share no graph, and may be followed one by one.
  const auto pose_losses = [&](const torch::Tensor& made, std::int64_t begin, double& pose_sum) {
    const auto part = [&](const torch::Tensor& x) { return x.narrow(1, begin, made.size(1)); };
    const torch::Tensor pose = MeanL1(made, part(truth));
    const torch::Tensor velocity = MeanL1(made - part(last), part(truth) - part(before));
    pose_sum += Value(pose);
    out.values.velocity += Value(velocity);
    return weights.pose * pose + weights.velocity * velocity;
  };
  if (config_.HasArms()) {
    out.arms_total =
        pose_losses(arms_, kTrunk, out.values.arms) + weights.divergence * divergence_arms_;
    out.values.divergence += Value(divergence_arms_);
  }
  out.body_total = pose_losses(trunk_, 0, out.values.body) + weights.divergence * divergence_body_;
  out.values.divergence += Value(divergence_body_);
  const torch::Tensor joints_truth = batch_.joints.select(1, t_);
  const auto counted = [&](const torch::Tensor& x) { return x.narrow(1, 0, weights.num_joints); };
  const torch::Tensor joints = MeanL1(counted(predicted.body.joints), counted(joints_truth));
  const torch::Tensor wrists =
      MeanL1(predicted.body.joints.narrow(1, 20, 2), joints_truth.narrow(1, 20, 2));
  out.values.joints = Value(joints);
  out.values.wrists = Value(wrists);
  out.body_total = out.body_total + weights.joints * joints + weights.wrists * wrists;
  if (root_step_.defined()) {
    const torch::Tensor root =
        MeanL1(root_step_, batch_.transl.select(1, t_) - batch_.transl.select(1, t_ - 1));
    out.values.root = Value(root);
    out.body_total = out.body_total + weights.root * root;
  }
  out.values.total = Value(out.body_total) + (config_.HasArms() ? Value(out.arms_total) : 0.0);
  return out;
}

void Unroller::Advance(const TorchFrame& frame) {
  history_.pop_front();
  history_.push_back(frame);
  ++t_;
}

}  // namespace holdfast::imos
