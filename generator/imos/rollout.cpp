// SPDX-License-Identifier: MIT
#include "generator/imos/rollout.h"

#include <algorithm>
#include <cassert>

#include "generator/wandr/rotation_6d.h"

namespace holdfast::imos {

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
Rollout<Real>::Rollout(const Network<Real>& network, int max_samples, int max_frames,
                       bool differentiable)
    : network_(network), max_samples_(max_samples), differentiable_(differentiable) {
  assert(max_frames >= kHistory);
  assert(!differentiable || network.IsDifferentiable());
  const Config& c = network.Options();
  frames_.resize(max_frames);
  for (KeyFrame<Real>& frame : frames_) {
    frame.Resize(c, max_samples);
    frame.SetZero();
  }
  if (c.HasArms()) {
    arms_condition_.emplace(network.ArmsCondition(), max_samples);
    codes_.arms.resize(c.arms_condition, max_samples);
  }
  body_condition_.emplace(network.BodyCondition(), max_samples);
  codes_.body.resize(c.body_condition, max_samples);
  const int num_tapes = differentiable ? max_frames - kHistory : 1;
  for (int k = 0; k < num_tapes; ++k) tapes_.emplace_back(network, max_samples);
  if (const Attention<Real>* attention = network.SelfAttention()) {
    attention_.push_back(attention->MakeTape());
  }
}

template <typename Real>
void Rollout<Real>::RunConditions(const ConstRef& conditions) {
  const Config& c = network_.Options();
  num_samples_ = static_cast<int>(conditions.cols());
  assert(num_samples_ <= max_samples_ && conditions.rows() == network_.ConditionSize());
  body_condition_->Resize(num_samples_);
  body_condition_->Input() = conditions;
  network_.BodyCondition().Forward(*body_condition_);
  codes_.body.leftCols(num_samples_) = body_condition_->Output();
  if (!c.HasArms()) return;
  arms_condition_->Resize(num_samples_);
  auto input = arms_condition_->Input();
  if (c.arms_see_class) {
    input = conditions;
  } else {
    input.topRows(kNumBetas) = conditions.topRows(kNumBetas);
    input.bottomRows(c.action_size) = conditions.bottomRows(c.action_size);
  }
  network_.ArmsCondition().Forward(*arms_condition_);
  codes_.arms.leftCols(num_samples_) = arms_condition_->Output();
}

template <typename Real>
void Rollout<Real>::Begin(const ConstRef& conditions) {
  RunConditions(conditions);
  num_frames_ = kHistory;
  num_attended_ = 0;
}

template <typename Real>
void Rollout<Real>::Begin(const ConstRef& conditions,
                          std::span<const KeyFrame<Real>, kHistory> history) {
  Begin(conditions);
  for (int f = 0; f < kHistory; ++f) {
    frames_[f].pose.leftCols(num_samples_) = history[f].pose.leftCols(num_samples_);
    frames_[f].root.leftCols(num_samples_) = history[f].root.leftCols(num_samples_);
    frames_[f].object.leftCols(num_samples_) = history[f].object.leftCols(num_samples_);
  }
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
  assert(num_frames_ < static_cast<int>(frames_.size()) && noise.cols() == num_samples_);
  // Attention depends only on its pose, so it is computed once for all windows with that pose.
  if (const Attention<Real>* attention = network_.SelfAttention()) {
    for (; num_attended_ < num_frames_; ++num_attended_) {
      KeyFrame<Real>& frame = frames_[num_attended_];
      for (int i = 0; i < num_samples_; ++i) {
        attention->Forward(frame.pose.col(i).data(), frame.attended.col(i).data(), attention_[0]);
      }
    }
  }
  const std::span<const KeyFrame<Real>, kHistory> past(&frames_[num_frames_ - kHistory], kHistory);
  KeyFrame<Real>& next = frames_[num_frames_];
  RunStep<Real>(network_, past, codes_, num_frames_, noise, TapeOf(num_frames_), next);
  next.object.leftCols(num_samples_) = past.back().object.leftCols(num_samples_);
  ++num_frames_;
}

template <typename Real>
void Rollout<Real>::SetObject(int sample,
                              const Eigen::Ref<const Eigen::Vector<Real, kObjectSize>>& object) {
  frames_[num_frames_ - 1].object.col(sample) = object;
}

template <typename Real>
void Rollout<Real>::SetRoot(int sample, const Eigen::Ref<const Eigen::Vector<Real, 3>>& root) {
  assert(network_.Options().root == RootTranslation::kGiven);
  frames_[num_frames_ - 1].root.col(sample) = root;
}

template <typename Real>
void Rollout<Real>::Backward(const RolloutSeed<Real>& seed, int rows,
                             RolloutGradient<Real>& gradient) const {
  assert(differentiable_);
  assert(seed.poses.empty() || static_cast<int>(seed.poses.size()) == num_frames_);
  assert(seed.roots.empty() || static_cast<int>(seed.roots.size()) == num_frames_);
  const Config& c = network_.Options();
  const int columns = num_samples_ * rows, steps = num_frames_ - kHistory;
  std::vector<KeyFrame<Real>> bars(num_frames_);
  for (int f = 0; f < num_frames_; ++f) {
    bars[f].Resize(c, columns);
    bars[f].SetZero();
    if (!seed.poses.empty() && seed.poses[f].size() > 0) bars[f].pose = seed.poses[f];
    if (!seed.roots.empty() && seed.roots[f].size() > 0) bars[f].root = seed.roots[f];
  }
  ConditionCodes<Real> codes_bar{Matrix::Zero(codes_.arms.rows(), columns),
                                 Matrix::Zero(codes_.body.rows(), columns)};
  gradient.noise.resize(Eigen::Index{c.NoiseSize()} * steps, columns);
  StepScratch<Real> scratch(network_, columns);

  const Attention<Real>* const attention = network_.SelfAttention();
  std::optional<typename Attention<Real>::Tape> tape;
  if (attention) tape = attention->MakeTape();
  std::vector<Real> attended(static_cast<std::size_t>(c.BodyPoseSize()));
  const auto through_attention = [&](int f) {
    if (!attention) return;
    for (int i = 0; i < num_samples_; ++i) {
      attention->Forward(frames_[f].pose.col(i).data(), attended.data(), *tape);
      for (int j = i * rows; j < (i + 1) * rows; ++j) {
        attention->Backward(*tape, bars[f].attended.col(j).data(), bars[f].pose.col(j).data());
      }
    }
  };
  Matrix noise_bar(c.NoiseSize(), columns);
  for (int f = num_frames_ - 1; f >= kHistory; --f) {
    through_attention(f);  // all windows with this frame are done
    const std::span<KeyFrame<Real>, kHistory> past_bar(&bars[f - kHistory], kHistory);
    StepBackward<Real>(network_, tapes_[f - kHistory], bars[f], rows, past_bar, codes_bar,
                       noise_bar, scratch);
    gradient.noise.middleRows(Eigen::Index{c.NoiseSize()} * (f - kHistory), c.NoiseSize()) =
        noise_bar;
  }
  for (int f = 0; f < kHistory; ++f) through_attention(f);

  nn::Scratch<Real> body_scratch(network_.BodyCondition(), columns);
  gradient.condition.resize(network_.ConditionSize(), columns);
  network_.BodyCondition().Backward(*body_condition_, codes_bar.body, gradient.condition,
                                    body_scratch);
  if (c.HasArms()) {
    nn::Scratch<Real> arms_scratch(network_.ArmsCondition(), columns);
    Matrix arms_bar(c.ArmsConditionInput(), columns);
    network_.ArmsCondition().Backward(*arms_condition_, codes_bar.arms, arms_bar, arms_scratch);
    const int common = c.arms_see_class ? kNumBetas + kNumObjects : kNumBetas;
    gradient.condition.topRows(common) += arms_bar.topRows(common);
    gradient.condition.bottomRows(c.action_size) += arms_bar.bottomRows(c.action_size);
  }
  gradient.objects.clear();
  for (KeyFrame<Real>& bar : bars) gradient.objects.push_back(std::move(bar.object));
  bars.resize(kHistory);
  gradient.history = std::move(bars);
}

template class Rollout<float>;
template class Rollout<double>;

}  // namespace holdfast::imos
