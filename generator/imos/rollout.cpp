// SPDX-License-Identifier: MIT
#include "generator/imos/rollout.h"

#include <algorithm>
#include <cassert>

#include "generator/wandr/rotation_6d.h"

namespace holdfast::imos {
namespace {

// Offset of the arms in a pose.
constexpr int kArmsOf = kNumTrunkJoints * kRotationSize;

// Writes the past inputs of sample i that both networks of the arms take; returns their end.
template <typename Real>
Real* PutArmsPast(const Config& c, std::span<const KeyFrame<Real>, kHistory> past, Real progress,
                  int i, Real* out) {
  for (const KeyFrame<Real>& frame : past) {
    for (const int joint : ArmJoints(c.arm_order)) {
      out = std::copy_n(frame.pose.col(i).data() + kRotationSize * joint, kRotationSize, out);
    }
  }
  for (const KeyFrame<Real>& frame : past) {
    out = std::copy_n(frame.object.col(i).data(), c.ArmsObjectSize(), out);
  }
  if (c.sees_progress) *out++ = progress;
  return out;
}

// Writes the input of the body's past encoder for sample i.
template <typename Real>
void PutBodyPast(const Config& c, std::span<const KeyFrame<Real>, kHistory> past,
                 const KeyFrame<Real>& next, Real progress, const Real* phi, int i, Real* out) {
  const auto put = [&](const Real* values, int count) { out = std::copy_n(values, count, out); };
  if (c.self_attention) {
    for (const KeyFrame<Real>& frame : past) put(frame.attended.col(i).data(), c.BodyPoseSize());
  }
  if (c.SeesPastPoses()) {
    for (const KeyFrame<Real>& frame : past) put(frame.pose.col(i).data(), c.BodyPoseSize());
  }
  if (c.has_arms) {
    for (const KeyFrame<Real>& frame : past) put(frame.pose.col(i).data() + kArmsOf, kArmsSize);
    if (c.body_sees_arms_now) put(next.pose.col(i).data() + kArmsOf, kArmsSize);
  }
  if (c.object_now != ObjectInput::kAbsent) put(past.back().object.col(i).data(), kObjectSize);
  for (const KeyFrame<Real>& frame : past) put(frame.object.col(i).data(), kObjectSize);
  if (c.predicts_root) {
    for (const KeyFrame<Real>& frame : past) put(frame.root.col(i).data(), 3);
  }
  if (c.sees_progress) *out++ = progress;
  std::copy_n(phi, c.body_condition, out);
}

// Writes z = mu + sigma eps.
template <typename Real, typename Code>
void Sample(const Code& code, const Real* noise, int size, Real* z) {
  for (int k = 0; k < size; ++k) z[k] = code[k] + code[size + k] * noise[k];
}

}  // namespace

Eigen::Vector<double, kObjectSize> ObjectColumn(const Eigen::Matrix3d& R, const Eigen::Vector3d& T,
                                                ObjectRotation rotation) {
  Eigen::Vector<double, kObjectSize> column;
  column << T, rotation == ObjectRotation::kRows ? wandr::Rows12<double>(R.transpose())
                                                 : wandr::Rows12<double>(R);
  return column;
}

Eigen::Vector<double, kPoseSize> PoseColumn(const wandr::Pose<double>& pose) {
  Eigen::Vector<double, kPoseSize> column;
  for (int j = 0; j < kNumPoseJoints; ++j) {
    column.segment<kRotationSize>(kRotationSize * j) = wandr::Rows12<double>(pose.rotation[j]);
  }
  return column;
}

wandr::Pose<double> PoseOfColumn(const Eigen::Ref<const Eigen::VectorXd>& column,
                                 const Eigen::Vector3d& root) {
  assert(column.size() == kPoseSize);
  wandr::Pose<double> pose;
  pose.translation = root;
  for (int j = 0; j < kNumPoseJoints; ++j) {
    pose.rotation[j] =
        wandr::RotationFromRows12<double>(column.segment<kRotationSize>(kRotationSize * j));
  }
  return pose;
}

template <typename Real>
Rollout<Real>::Rollout(const Network<Real>& network, int max_samples, int max_frames)
    : network_(network),
      max_samples_(max_samples),
      frames_(max_frames),
      body_condition_(network.BodyCondition(), max_samples),
      body_encoder_(network.BodyEncoder(), max_samples),
      body_decoder_(network.BodyDecoder(), max_samples) {
  assert(max_frames >= kHistory);
  const Config& c = network.Options();
  for (KeyFrame<Real>& frame : frames_) {
    frame.pose.setZero(kPoseSize, max_samples);
    frame.root.setZero(3, max_samples);
    frame.object.setZero(kObjectSize, max_samples);
    frame.attended.setZero(c.self_attention ? c.BodyPoseSize() : 0, max_samples);
  }
  if (c.has_arms) {
    arms_condition_.emplace(network.ArmsCondition(), max_samples);
    arms_encoder_.emplace(network.ArmsEncoder(), max_samples);
    arms_decoder_.emplace(network.ArmsDecoder(), max_samples);
  }
}

template <typename Real>
void Rollout<Real>::Begin(const ConstRef& conditions) {
  const Config& c = network_.Options();
  num_samples_ = static_cast<int>(conditions.cols());
  num_frames_ = kHistory;
  num_attended_ = 0;
  assert(num_samples_ <= max_samples_ && conditions.rows() == network_.ConditionSize());
  for (auto* tape : {&body_condition_, &body_encoder_, &body_decoder_}) tape->Resize(num_samples_);
  body_condition_.Input() = conditions;
  network_.BodyCondition().Forward(body_condition_);
  if (!c.has_arms) return;
  for (auto* tape : {&arms_condition_, &arms_encoder_, &arms_decoder_}) {
    (*tape)->Resize(num_samples_);
  }
  auto input = arms_condition_->Input();
  if (c.arms_see_class) {
    input = conditions;
  } else {
    input.topRows(kNumBetas) = conditions.topRows(kNumBetas);
    input.bottomRows(c.action_size) = conditions.bottomRows(c.action_size);
  }
  network_.ArmsCondition().Forward(*arms_condition_);
}

template <typename Real>
void Rollout<Real>::SetHistory(int frame, int sample,
                               const Eigen::Ref<const Eigen::Vector<Real, kPoseSize>>& p,
                               const Eigen::Ref<const Eigen::Vector<Real, 3>>& root,
                               const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object) {
  assert(num_frames_ == kHistory && num_attended_ == 0 && frame < kHistory);
  frames_[frame].pose.col(sample) = p;
  frames_[frame].root.col(sample) = root;
  frames_[frame].object.col(sample) = object;
}

template <typename Real>
void Rollout<Real>::Step(const ConstRef& noise) {
  assert(num_frames_ < static_cast<int>(frames_.size()));
  assert(noise.cols() == num_samples_ && noise.rows() == network_.Options().NoiseSize());
  // Attention depends only on its pose, so it is computed once for all windows with that pose.
  if (const Attention<Real>* attention = network_.SelfAttention()) {
    for (; num_attended_ < num_frames_; ++num_attended_) {
      KeyFrame<Real>& frame = frames_[num_attended_];
      for (int i = 0; i < num_samples_; ++i) {
        attention->Forward(frame.pose.col(i).data(), frame.attended.col(i).data());
      }
    }
  }
  const Past past(&frames_[num_frames_ - kHistory], kHistory);
  KeyFrame<Real>& next = frames_[num_frames_];
  if (network_.Options().has_arms) RunArms(past, noise, next);
  RunBody(past, noise, next);
  next.object.leftCols(num_samples_) = past.back().object.leftCols(num_samples_);
  ++num_frames_;
}

template <typename Real>
void Rollout<Real>::RunArms(Past past, const ConstRef& noise, KeyFrame<Real>& next) {
  const Config& c = network_.Options();
  const Real progress = static_cast<Real>(ProgressOf(num_frames_));
  const auto phi = arms_condition_->Output();
  auto input = arms_encoder_->Input();
  for (int i = 0; i < num_samples_; ++i) {
    Real* const end = PutArmsPast<Real>(c, past, progress, i, input.col(i).data());
    std::copy_n(phi.col(i).data(), c.arms_condition, end);
  }
  network_.ArmsEncoder().Forward(*arms_encoder_);
  auto decoder_input = arms_decoder_->Input();
  for (int i = 0; i < num_samples_; ++i) {
    Real* const z = std::copy_n(phi.col(i).data(), c.arms_condition, decoder_input.col(i).data());
    Sample(arms_encoder_->Output().col(i), noise.col(i).data(), c.arms_latent, z);
    PutArmsPast<Real>(c, past, progress, i, z + c.arms_latent);
  }
  network_.ArmsDecoder().Forward(*arms_decoder_);
  const auto output = arms_decoder_->Output();
  const auto order = ArmJoints(c.arm_order);
  for (int i = 0; i < num_samples_; ++i) {
    for (int slot = 0; slot < kNumArmJoints; ++slot) {
      const int at = kRotationSize * order[slot];
      next.pose.col(i).template segment<kRotationSize>(at) =
          past.back().pose.col(i).template segment<kRotationSize>(at) +
          output.col(i).template segment<kRotationSize>(kRotationSize * slot);
    }
  }
}

template <typename Real>
void Rollout<Real>::RunBody(Past past, const ConstRef& noise, KeyFrame<Real>& next) {
  const Config& c = network_.Options();
  const Real progress = static_cast<Real>(ProgressOf(num_frames_));
  const int noise_of = c.NoiseSize() - c.body_latent;
  const auto phi = body_condition_.Output();
  auto input = body_encoder_.Input();
  for (int i = 0; i < num_samples_; ++i) {
    PutBodyPast<Real>(c, past, next, progress, phi.col(i).data(), i, input.col(i).data());
  }
  network_.BodyEncoder().Forward(body_encoder_);
  auto decoder_input = body_decoder_.Input();
  for (int i = 0; i < num_samples_; ++i) {
    Real* const z = decoder_input.col(i).data();
    Sample(body_encoder_.Output().col(i), noise.col(i).data() + noise_of, c.body_latent, z);
    std::copy_n(input.col(i).data(), c.BodyPastInput(), z + c.body_latent);
  }
  network_.BodyDecoder().Forward(body_decoder_);
  const auto output = body_decoder_.Output();
  for (int i = 0; i < num_samples_; ++i) {
    next.pose.col(i).head(c.BodyPoseSize()) = output.col(i).head(c.BodyPoseSize());
    if (c.makes_steps) {
      next.pose.col(i).head(c.BodyPoseSize()) += past.back().pose.col(i).head(c.BodyPoseSize());
    }
    next.root.col(i) = past.back().root.col(i);
    if (c.predicts_root) {
      next.root.col(i) += output.col(i).template tail<3>();
    }
  }
}

template <typename Real>
void Rollout<Real>::SetObject(int sample,
                              const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object) {
  frames_[num_frames_ - 1].object.col(sample) = object;
}

template <typename Real>
void Rollout<Real>::SetRoot(int sample, const Eigen::Ref<const Eigen::Vector<Real, 3>>& root) {
  assert(!network_.Options().predicts_root);
  frames_[num_frames_ - 1].root.col(sample) = root;
}

template class Rollout<float>;
template class Rollout<double>;

}  // namespace holdfast::imos
