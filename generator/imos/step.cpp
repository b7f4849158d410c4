// SPDX-License-Identifier: MIT
#include "generator/imos/step.h"

#include <algorithm>
#include <cassert>

namespace holdfast::imos {
namespace {

// Offset of the arms in a pose.
constexpr int kArmsOf = kNumTrunkJoints * kRotationSize;

// Writes the parts of a column in order.
template <typename Real>
class ColumnWriter {
 public:
  explicit ColumnWriter(Real* begin) : next_(begin) {}
  void Put(const Real* values, int count) { next_ = std::copy_n(values, count, next_); }
  void Put(Real value) { *next_++ = value; }
  void PutArms(const Real* pose, const std::array<int, kNumArmJoints>& order) {
    for (const int joint : order) Put(pose + kRotationSize * joint, kRotationSize);
  }

 private:
  Real* next_;
};

// Reads the gradient of a column in the same order, and adds each part to its destination.
template <typename Real>
class ColumnAdder {
 public:
  explicit ColumnAdder(const Real* begin) : next_(begin) {}
  void AddTo(Real* sums, int count) {
    for (int i = 0; i < count; ++i) sums[i] += next_[i];
    next_ += count;
  }
  /// Skips values whose gradient is not needed.
  void Skip(int count) { next_ += count; }
  void AddArmsTo(Real* pose, const std::array<int, kNumArmJoints>& order) {
    for (const int joint : order) AddTo(pose + kRotationSize * joint, kRotationSize);
  }

 private:
  const Real* next_;
};

// Past inputs shared by both networks of the arms.
template <typename Real>
void PutArmsPast(const Config& c, std::span<const KeyFrame<Real>, kHistory> past, Real progress,
                 int i, ColumnWriter<Real>& out) {
  const auto order = ArmJoints(c.arm_order);
  for (const KeyFrame<Real>& frame : past) out.PutArms(frame.pose.col(i).data(), order);
  for (const KeyFrame<Real>& frame : past) {
    out.Put(frame.object.col(i).data(), c.ArmsObjectSize());
  }
  if (c.sees_progress) out.Put(progress);
}

template <typename Real>
void AddArmsPast(const Config& c, ColumnAdder<Real>& bars,
                 std::span<KeyFrame<Real>, kHistory> past_bar, int i) {
  const auto order = ArmJoints(c.arm_order);
  for (KeyFrame<Real>& frame : past_bar) bars.AddArmsTo(frame.pose.col(i).data(), order);
  for (KeyFrame<Real>& frame : past_bar) {
    bars.AddTo(frame.object.col(i).data(), c.ArmsObjectSize());
  }
  bars.Skip(c.ProgressSize());
}

// Writes z = mu + sigma eps.
template <typename Real, typename Code>
void Sample(const Code& code, const Real* noise, int size, Real* z) {
  for (int k = 0; k < size; ++k) z[k] = code[k] + code[size + k] * noise[k];
}

// Gradients of mu and sigma (stacked) and of eps, from that of z.
template <typename Real, typename Code>
void SampleBackward(const Code& code, const Real* noise, int size, const Real* z_bar,
                    Real* code_bar, Real* noise_bar) {
  for (int k = 0; k < size; ++k) {
    code_bar[k] = z_bar[k];
    code_bar[size + k] = z_bar[k] * noise[k];
    noise_bar[k] = z_bar[k] * code[size + k];
  }
}

template <typename Real>
void RunArms(const Network<Real>& network, std::span<const KeyFrame<Real>, kHistory> past,
             const ConditionCodes<Real>& codes, StepTape<Real>& tape, KeyFrame<Real>& next,
             int samples) {
  const Config& c = network.Options();
  const auto order = ArmJoints(c.arm_order);
  auto input = tape.arms_encoder->Input();
  for (int i = 0; i < samples; ++i) {
    ColumnWriter<Real> out(input.col(i).data());
    PutArmsPast(c, past, tape.progress, i, out);
    out.Put(codes.arms.col(i).data(), c.arms_condition);
  }
  network.ArmsEncoder().Forward(*tape.arms_encoder);
  auto decoder_input = tape.arms_decoder->Input();
  for (int i = 0; i < samples; ++i) {
    Real* const column = decoder_input.col(i).data();
    ColumnWriter<Real> out(column);
    out.Put(codes.arms.col(i).data(), c.arms_condition);
    Real* const z = column + c.arms_condition;
    Sample(tape.arms_encoder->Output().col(i), tape.noise.col(i).data(), c.arms_latent, z);
    ColumnWriter<Real> rest(z + c.arms_latent);
    PutArmsPast(c, past, tape.progress, i, rest);
  }
  network.ArmsDecoder().Forward(*tape.arms_decoder);
  const auto output = tape.arms_decoder->Output();
  for (int i = 0; i < samples; ++i) {
    for (int slot = 0; slot < kNumArmJoints; ++slot) {
      const int at = kRotationSize * order[slot];
      next.pose.col(i).template segment<kRotationSize>(at) =
          past.back().pose.col(i).template segment<kRotationSize>(at) +
          output.col(i).template segment<kRotationSize>(kRotationSize * slot);
    }
  }
}

template <typename Real>
void PutBodyPast(const Config& c, std::span<const KeyFrame<Real>, kHistory> past,
                 const KeyFrame<Real>& next, Real progress, const Real* phi, int i,
                 ColumnWriter<Real>& out) {
  if (c.self_attention) {
    for (const KeyFrame<Real>& frame : past) {
      out.Put(frame.attended.col(i).data(), c.BodyPoseSize());
    }
  }
  if (c.SeesPastPoses()) {
    for (const KeyFrame<Real>& frame : past) out.Put(frame.pose.col(i).data(), c.BodyPoseSize());
  }
  if (c.HasArms()) {
    for (const KeyFrame<Real>& frame : past) {
      out.Put(frame.pose.col(i).data() + kArmsOf, kArmsSize);
    }
    if (c.body_sees_arms_now) out.Put(next.pose.col(i).data() + kArmsOf, kArmsSize);
  }
  if (c.object_now != ObjectInput::kAbsent) out.Put(past.back().object.col(i).data(), kObjectSize);
  for (const KeyFrame<Real>& frame : past) out.Put(frame.object.col(i).data(), kObjectSize);
  if (c.root == RootTranslation::kPredicted) {
    for (const KeyFrame<Real>& frame : past) out.Put(frame.root.col(i).data(), 3);
  }
  if (c.sees_progress) out.Put(progress);
  out.Put(phi, c.body_condition);
}

// `arms_bar` is the gradient of the next key frame's arms, joints ascending.
template <typename Real>
void AddBodyPast(const Config& c, ColumnAdder<Real>& bars,
                 std::span<KeyFrame<Real>, kHistory> past_bar, Real* arms_bar, Real* phi_bar,
                 int i) {
  if (c.self_attention) {
    for (KeyFrame<Real>& frame : past_bar) {
      bars.AddTo(frame.attended.col(i).data(), c.BodyPoseSize());
    }
  }
  if (c.SeesPastPoses()) {
    for (KeyFrame<Real>& frame : past_bar) bars.AddTo(frame.pose.col(i).data(), c.BodyPoseSize());
  }
  if (c.HasArms()) {
    for (KeyFrame<Real>& frame : past_bar) {
      bars.AddTo(frame.pose.col(i).data() + kArmsOf, kArmsSize);
    }
    if (c.body_sees_arms_now) bars.AddTo(arms_bar, kArmsSize);
  }
  if (c.object_now != ObjectInput::kAbsent) {
    bars.AddTo(past_bar.back().object.col(i).data(), kObjectSize);
  }
  for (KeyFrame<Real>& frame : past_bar) bars.AddTo(frame.object.col(i).data(), kObjectSize);
  if (c.root == RootTranslation::kPredicted) {
    for (KeyFrame<Real>& frame : past_bar) bars.AddTo(frame.root.col(i).data(), 3);
  }
  bars.Skip(c.ProgressSize());
  bars.AddTo(phi_bar, c.body_condition);
}

template <typename Real>
void RunBody(const Network<Real>& network, std::span<const KeyFrame<Real>, kHistory> past,
             const ConditionCodes<Real>& codes, StepTape<Real>& tape, KeyFrame<Real>& next,
             int samples) {
  const Config& c = network.Options();
  const int noise_of = c.NoiseSize() - c.body_latent;
  auto input = tape.body_encoder->Input();
  for (int i = 0; i < samples; ++i) {
    ColumnWriter<Real> out(input.col(i).data());
    PutBodyPast(c, past, next, tape.progress, codes.body.col(i).data(), i, out);
  }
  network.BodyEncoder().Forward(*tape.body_encoder);
  auto decoder_input = tape.body_decoder->Input();
  for (int i = 0; i < samples; ++i) {
    Real* const column = decoder_input.col(i).data();
    Sample(tape.body_encoder->Output().col(i), tape.noise.col(i).data() + noise_of, c.body_latent,
           column);
    std::copy_n(input.col(i).data(), c.BodyPastInput(), column + c.body_latent);
  }
  network.BodyDecoder().Forward(*tape.body_decoder);
  const auto output = tape.body_decoder->Output();
  const bool predicted = c.root == RootTranslation::kPredicted;
  for (int i = 0; i < samples; ++i) {
    next.pose.col(i).head(c.BodyPoseSize()) = output.col(i).head(c.BodyPoseSize());
    if (c.body_makes == BodyMakes::kStep) {
      next.pose.col(i).head(c.BodyPoseSize()) += past.back().pose.col(i).head(c.BodyPoseSize());
    }
    next.root.col(i) = past.back().root.col(i);
    if (predicted) next.root.col(i) += output.col(i).template tail<3>();
  }
}

}  // namespace

template <typename Real>
void KeyFrame<Real>::Resize(const Config& config, int columns) {
  pose.resize(kPoseSize, columns);
  root.resize(3, columns);
  object.resize(kObjectSize, columns);
  attended.resize(config.self_attention ? config.BodyPoseSize() : 0, columns);
}

template <typename Real>
void KeyFrame<Real>::SetZero() {
  for (Matrix* part : {&pose, &root, &object, &attended}) part->setZero();
}

template <typename Real>
StepTape<Real>::StepTape(const Network<Real>& network, int max_samples)
    : noise(network.Options().NoiseSize(), max_samples) {
  if (network.Options().HasArms()) {
    arms_encoder.emplace(network.ArmsEncoder(), max_samples);
    arms_decoder.emplace(network.ArmsDecoder(), max_samples);
  }
  body_encoder.emplace(network.BodyEncoder(), max_samples);
  body_decoder.emplace(network.BodyDecoder(), max_samples);
}

template <typename Real>
void StepTape<Real>::Resize(int num_samples) {
  for (auto* tape : {&arms_encoder, &arms_decoder, &body_encoder, &body_decoder}) {
    if (*tape) (*tape)->Resize(num_samples);
  }
}

template <typename Real>
StepScratch<Real>::StepScratch(const Network<Real>& network, int max_gradients) {
  const Config& c = network.Options();
  if (c.HasArms()) {
    arms_encoder.emplace(network.ArmsEncoder(), max_gradients);
    arms_decoder.emplace(network.ArmsDecoder(), max_gradients);
  }
  body_encoder.emplace(network.BodyEncoder(), max_gradients);
  body_decoder.emplace(network.BodyDecoder(), max_gradients);
  const int arms_past = c.HasArms() ? c.ArmsDecoderInput() : 0;
  output_bar.resize(std::max(c.BodyOutput(), kArmsSize), max_gradients);
  code_bar.resize(2 * std::max(c.body_latent, c.arms_latent), max_gradients);
  encoder_input_bar.resize(std::max(c.BodyDecoderInput(), arms_past), max_gradients);
  decoder_input_bar.resize(encoder_input_bar.rows(), max_gradients);
  arms_bar.resize(kArmsSize, max_gradients);
}

template <typename Real>
void RunStep(const Network<Real>& network, std::span<const KeyFrame<Real>, kHistory> past,
             const ConditionCodes<Real>& codes, int frame,
             const Eigen::Ref<const typename KeyFrame<Real>::Matrix>& noise, StepTape<Real>& tape,
             KeyFrame<Real>& next) {
  const int samples = static_cast<int>(noise.cols());
  assert(noise.rows() == network.Options().NoiseSize());
  tape.Resize(samples);
  tape.noise.leftCols(samples) = noise;
  tape.progress = static_cast<Real>(ProgressOf(frame));
  if (network.Options().HasArms()) RunArms(network, past, codes, tape, next, samples);
  RunBody(network, past, codes, tape, next, samples);
}

template <typename Real>
void StepBackward(const Network<Real>& network, const StepTape<Real>& tape,
                  const KeyFrame<Real>& next_bar, int rows,
                  std::span<KeyFrame<Real>, kHistory> past_bar, ConditionCodes<Real>& codes_bar,
                  Eigen::Ref<typename KeyFrame<Real>::Matrix> noise_bar,
                  StepScratch<Real>& scratch) {
  const Config& c = network.Options();
  const int columns = tape.body_encoder->NumColumns() * rows;
  const int noise_of = c.NoiseSize() - c.body_latent;
  const bool predicted = c.root == RootTranslation::kPredicted;

  auto body_bar = scratch.output_bar.topLeftCorner(c.BodyOutput(), columns);
  body_bar.topRows(c.BodyPoseSize()) = next_bar.pose.topLeftCorner(c.BodyPoseSize(), columns);
  if (predicted) body_bar.template bottomRows<3>() = next_bar.root.leftCols(columns);
  past_bar.back().root.leftCols(columns) += next_bar.root.leftCols(columns);
  if (c.body_makes == BodyMakes::kStep) {
    past_bar.back().pose.topLeftCorner(c.BodyPoseSize(), columns) +=
        next_bar.pose.topLeftCorner(c.BodyPoseSize(), columns);
  }
  auto decoder_bar = scratch.decoder_input_bar.topLeftCorner(c.BodyDecoderInput(), columns);
  auto encoder_bar = scratch.encoder_input_bar.topLeftCorner(c.BodyPastInput(), columns);
  auto code_bar = scratch.code_bar.topLeftCorner(2 * c.body_latent, columns);
  network.BodyDecoder().Backward(*tape.body_decoder, body_bar, decoder_bar, *scratch.body_decoder);
  for (int j = 0; j < columns; ++j) {
    SampleBackward(tape.body_encoder->Output().col(j / rows),
                   tape.noise.col(j / rows).data() + noise_of, c.body_latent,
                   decoder_bar.col(j).data(), code_bar.col(j).data(),
                   noise_bar.col(j).data() + noise_of);
  }
  network.BodyEncoder().Backward(*tape.body_encoder, code_bar, encoder_bar, *scratch.body_encoder);
  encoder_bar += decoder_bar.bottomRows(c.BodyPastInput());
  auto arms_bar = scratch.arms_bar.leftCols(columns);
  if (c.HasArms()) arms_bar = next_bar.pose.block(kArmsOf, 0, kArmsSize, columns);
  for (int j = 0; j < columns; ++j) {
    ColumnAdder<Real> bars(encoder_bar.col(j).data());
    AddBodyPast(c, bars, past_bar, arms_bar.col(j).data(), codes_bar.body.col(j).data(), j);
  }
  if (!c.HasArms()) return;

  const auto order = ArmJoints(c.arm_order);
  past_bar.back().pose.block(kArmsOf, 0, kArmsSize, columns) += arms_bar;
  auto slots_bar = scratch.output_bar.topLeftCorner(kArmsSize, columns);
  for (int slot = 0; slot < kNumArmJoints; ++slot) {
    slots_bar.template middleRows<kRotationSize>(kRotationSize * slot) =
        arms_bar.template middleRows<kRotationSize>(kRotationSize *
                                                    (order[slot] - kNumTrunkJoints));
  }
  auto arms_decoder_bar = scratch.decoder_input_bar.topLeftCorner(c.ArmsDecoderInput(), columns);
  auto arms_encoder_bar = scratch.encoder_input_bar.topLeftCorner(c.ArmsPastInput(), columns);
  auto arms_code_bar = scratch.code_bar.topLeftCorner(2 * c.arms_latent, columns);
  network.ArmsDecoder().Backward(*tape.arms_decoder, slots_bar, arms_decoder_bar,
                                 *scratch.arms_decoder);
  for (int j = 0; j < columns; ++j) {
    const Real* const column = arms_decoder_bar.col(j).data();
    SampleBackward(tape.arms_encoder->Output().col(j / rows), tape.noise.col(j / rows).data(),
                   c.arms_latent, column + c.arms_condition, arms_code_bar.col(j).data(),
                   noise_bar.col(j).data());
    ColumnAdder<Real> phi(column);
    phi.AddTo(codes_bar.arms.col(j).data(), c.arms_condition);
    ColumnAdder<Real> rest(column + c.arms_condition + c.arms_latent);
    AddArmsPast(c, rest, past_bar, j);
  }
  network.ArmsEncoder().Backward(*tape.arms_encoder, arms_code_bar, arms_encoder_bar,
                                 *scratch.arms_encoder);
  for (int j = 0; j < columns; ++j) {
    ColumnAdder<Real> bars(arms_encoder_bar.col(j).data());
    AddArmsPast(c, bars, past_bar, j);
    bars.AddTo(codes_bar.arms.col(j).data(), c.arms_condition);
  }
}

#define HOLDFAST_INSTANTIATE(Real)                                                              \
  template struct KeyFrame<Real>;                                                               \
  template class StepTape<Real>;                                                                \
  template class StepScratch<Real>;                                                             \
  template void RunStep<Real>(const Network<Real>&, std::span<const KeyFrame<Real>, kHistory>,  \
                              const ConditionCodes<Real>&, int,                                 \
                              const Eigen::Ref<const KeyFrame<Real>::Matrix>&, StepTape<Real>&, \
                              KeyFrame<Real>&);                                                 \
  template void StepBackward<Real>(const Network<Real>&, const StepTape<Real>&,                 \
                                   const KeyFrame<Real>&, int,                                  \
                                   std::span<KeyFrame<Real>, kHistory>, ConditionCodes<Real>&,  \
                                   Eigen::Ref<KeyFrame<Real>::Matrix>, StepScratch<Real>&);
HOLDFAST_INSTANTIATE(float)
HOLDFAST_INSTANTIATE(double)
#undef HOLDFAST_INSTANTIATE

}  // namespace holdfast::imos
