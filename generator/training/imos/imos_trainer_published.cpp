// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_trainer_state.h"

namespace holdfast::imos {
namespace {

constexpr int kTruthAgain = 9;  // key frame before which the history is the truth, in every epoch

TorchFrame Detached(const TorchFrame& frame, const TorchFrame& truth) {
  TorchFrame out;
  out.pose = frame.pose.detach();
  out.transl = frame.transl.detach();
  out.object = truth.object;
  out.body = truth.body;
  return out;
}

}  // namespace

// One step of Adam per key frame and module; nothing is learned through time.
Losses Trainer::Impl::StepAsPublished(nn::RandomStream& random) {
  const std::vector<std::int64_t> rows = DrawRows();
  const SequenceTensors batch = data.Rows(rows);
  at::Generator generator = GeneratorOf(random);
  Pass pass;
  pass.batch_statistics = true;
  pass.dropout = options.dropout;
  pass.generator = &generator;
  const bool true_history = Epoch() < options.true_history_epochs;
  Unroller unroller(networks, batch, kHistory, options.history_noise, pass, generator);
  constexpr double kShare = 1.0 / (kNumKeyFrames - kHistory);
  Losses sum;
  for (int t = kHistory; t < kNumKeyFrames; ++t) {
    if (t > kHistory && (true_history || t == kTruthAgain)) unroller.ForgetPredictions();
    StepOptions how;
    how.true_arms = how.true_object_now = true;
    // A fair coin per call, not per row.
    how.present_share =
        options.config.HasArms() && random.Uniform() < options.present_share ? 1.0 : 0.0;
    unroller.Refresh();
    const TorchFrame frame = unroller.Predict(how);
    const StepLosses losses = unroller.Judge(frame, options.losses);
    std::size_t k = 0;
    double gradient = 0.0;
    for (const torch::Tensor& loss : {losses.arms_total, losses.body_total}) {
      if (!loss.defined()) continue;
      OptimizerOf& optimizer = optimizers[k++];
      for (auto& group : optimizer.adam->param_groups()) {
        group.options().set_lr(optimizer.plateau.rate);
      }
      gradient = std::max(gradient, optimizer.StepBy(loss, options.largest_gradient));
      optimizer.epoch_loss += kShare * loss.detach().item<double>();
    }
    sum.Add(losses.values, kShare);
    sum.gradient += kShare * gradient;
    unroller.Advance(Detached(frame, unroller.Truth(t)));
  }
  const Pass* const passes[] = {&pass};
  networks.TakeStatistics(passes);
  if ((iteration + 1) % (data.Count() / options.batch) == 0) {
    for (OptimizerOf& optimizer : optimizers) {
      optimizer.plateau.Observe(optimizer.epoch_loss /
                                static_cast<double>(data.Count() / options.batch));
      optimizer.epoch_loss = 0.0;
    }
  }
  return sum;
}

}  // namespace holdfast::imos
