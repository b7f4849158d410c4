// SPDX-License-Identifier: MIT
#include "solver/fit/hold_evaluation.h"

#include <algorithm>
#include <numeric>

#include "geometry/parallel.h"
#include "solver/fit/fitted_hand.h"

namespace holdfast {
namespace {

// Successive frames handled by one worker. The points that a term watches depend only on the frames
// before in the same chunk.
constexpr int kChunk = 32;

}  // namespace

HoldCost::HoldCost(int hold_index, int frame_index, const FittedFrame& frame_state, int hand,
                   bool moves_too)
    : hold(hold_index),
      frame(frame_index),
      orientation(frame_state.object.orientation.coeffs().data()),
      translation(frame_state.object.translation.data()),
      fingers(frame_state.hands[hand].fingers),
      moves(moves_too) {
  set_num_residuals(HandObjectBlock::kRows);
  *mutable_parameter_block_sizes() = {4, 3, kHandDofs};
  if (moves) {
    mutable_parameter_block_sizes()->push_back(4);
    mutable_parameter_block_sizes()->push_back(3);
  }
  const std::vector<int>& sizes = parameter_block_sizes();
  jacobians_.resize(static_cast<std::size_t>(HandObjectBlock::kRows *
                                             std::accumulate(sizes.begin(), sizes.end(), 0)));
}

bool HoldCost::Evaluate(double const* const*, double* residuals, double** jacobians) const {
  if (!finite_) return false;
  std::ranges::copy(residuals_, residuals);
  if (jacobians == nullptr) return true;
  const double* next = jacobians_.data();
  for (std::size_t b = 0; b < parameter_block_sizes().size(); ++b) {
    const int size = HandObjectBlock::kRows * parameter_block_sizes()[b];
    if (jacobians[b] != nullptr) std::copy_n(next, size, jacobians[b]);
    next += size;
  }
  return true;
}

// One hand of one thread.
struct HoldEvaluation::Worker {
  // The block of one hold, created on demand; the last one is cached.
  HandObjectBlock& Block(int hold, const HoldTerms& terms) {
    if (block_hold == hold) return *block;
    block = std::make_unique<HandObjectBlock>(&state);
    slip.reset();
    if (terms.SlipTerm() != nullptr) {
      slip = std::make_unique<Slip>(*terms.SlipTerm());  // its marks change with the frame
      block->AddTerm(EnergyTerm::kSlip, slip.get());
    } else {
      terms.AddTo(*block);
    }
    for (const auto& [kind, term] : skin_terms) block->AddTerm(kind, term.get());
    block->WatchAlways();
    block_hold = hold;
    return *block;
  }

  HandState state;
  SkinTerms skin_terms;
  std::unique_ptr<HandObjectBlock> block = nullptr;
  std::unique_ptr<Slip> slip = nullptr;
  int block_hold = -1;
};

HoldEvaluation::HoldEvaluation(const ClipProblem& problem, const FitOptions& options, int threads)
    : problem_(problem), options_(options), threads_(threads) {
  for (const HandModel* hand : problem.hands) {
    anatomy_.push_back(std::make_unique<HandAnatomy>(*hand));
  }
  for (const ClipHold& hold : problem.holds) {
    terms_.push_back(std::make_unique<HoldTerms>(problem.object, hold.at, hold.slip, options));
  }
  for (int k = 0; k < std::max(1, threads); ++k) {
    Workers& hands = workers_.emplace_back();
    for (std::size_t h = 0; h < problem.hands.size(); ++h) {
      hands.emplace_back(new Worker{HandState(*problem.hands[h]),
                                    MakeSkinTerms(*anatomy_[h], problem.object, options)});
    }
  }
}

HoldEvaluation::~HoldEvaluation() = default;

void HoldEvaluation::PrepareForEvaluation(bool, bool new_evaluation_point) {
  // Most trial points are accepted, so Jacobians are computed at once, while the hand is available,
  // not in a second pass.
  if (new_evaluation_point || !evaluated_) EvaluateAll();
}

void HoldEvaluation::MarkContacts() {
  std::vector<std::vector<Slip::Mark>> last(problem_.holds.size());
  for (const auto& held : frames_) {
    const auto k = static_cast<std::size_t>(held->hold);
    const Slip* const slip = terms_[k]->SlipTerm();
    if (slip == nullptr) continue;
    const ClipHold& hold = problem_.holds[k];
    HandState& state = workers_.front()[hold.hand]->state;
    state.SetBody(held->body, problem_.source.trans.col(held->frame));
    state.Evaluate(held->fingers, false);
    if (held->frame == hold.begin) last[k] = slip->MarksOf(hold.at);
    held->marks = last[k];
    last[k] = slip->MarksOf(InObjectFrame(state.Vertices(),
                                          Eigen::Map<const Eigen::Quaterniond>(held->orientation),
                                          Eigen::Map<const Eigen::Vector3d>(held->translation)));
  }
}

void HoldEvaluation::EvaluateAll() {
  const auto count = static_cast<int>(frames_.size());
  ParallelFor((count + kChunk - 1) / kChunk, threads_, [&](int chunk) {
    Workers hands;
    {
      const std::lock_guard lock(mutex_);
      hands = std::move(workers_.back());
      workers_.pop_back();
    }
    for (const auto& worker : hands) {
      for (const auto& [kind, term] : worker->skin_terms) term->Forget();
    }
    const int end = std::min(count, (chunk + 1) * kChunk);
    for (int k = chunk * kChunk; k < end; ++k) {
      HoldCost& held = *frames_[k];
      Evaluate(*hands[problem_.holds[held.hold].hand], held);
    }
    const std::lock_guard lock(mutex_);
    workers_.push_back(std::move(hands));
  });
  evaluated_ = true;
}

void HoldEvaluation::Evaluate(Worker& worker, HoldCost& held) const {
  HandState& state = worker.state;
  HandObjectBlock& block = worker.Block(held.hold, *terms_[held.hold]);
  state.SetBody(held.body, problem_.source.trans.col(held.frame));
  block.Invalidate();
  if (worker.slip != nullptr) worker.slip->SetMarks(held.marks);

  std::array<double*, 5> jacobians{};
  double* next = held.jacobians_.data();
  for (std::size_t b = 0; b < held.parameter_block_sizes().size(); ++b) {
    jacobians[b] = next;
    next += HandObjectBlock::kRows * held.parameter_block_sizes()[b];
  }
  const double* parameters[] = {held.orientation, held.translation, held.fingers.data(),
                                held.step.rotation.coeffs().data(), held.step.translation.data()};
  ObjectPose seen(Eigen::Map<const Eigen::Quaterniond>(held.orientation),
                  Eigen::Map<const Eigen::Vector3d>(held.translation));
  if (held.moves) {
    const WristOffsetBlock moved(&block, &state);
    held.finite_ = moved.Evaluate(parameters, held.residuals_.data(), jacobians.data());
    seen = SeenByUnmovedHand(state, seen, held.step);
  } else {
    held.finite_ = block.Evaluate(parameters, held.residuals_.data(), jacobians.data());
  }
  if (!held.finite_) return;

  const double* at[] = {seen.orientation.coeffs().data(), seen.translation.data(),
                        held.fingers.data()};
  held.energies = block.EnergiesAt(at);
}

}  // namespace holdfast
