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
      fingers(frame_state.hands[static_cast<std::size_t>(hand)].fingers),
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

struct HoldEvaluation::Worker {
  struct Hand {
    std::unique_ptr<HandState> state;
    SkinTerms skin_terms;
  };

  // The block of one hold, created on demand; the last one is cached.
  HandObjectBlock& Block(const ClipProblem& problem, int hold, const HoldTerms& terms) {
    const auto h = static_cast<std::size_t>(problem.holds[static_cast<std::size_t>(hold)].hand);
    if (block_hold[h] != hold) {
      blocks[h] = std::make_unique<HandObjectBlock>(hands[h].state.get());
      slips[h].reset();
      if (terms.Slips()) {
        slips[h] = std::make_unique<Slip>(*terms.SlipTerm());  // its marks change with the frame
        blocks[h]->AddTerm(EnergyTerm::kSlip, slips[h].get());
      } else {
        terms.AddTo(*blocks[h]);
      }
      for (const auto& [kind, term] : hands[h].skin_terms) blocks[h]->AddTerm(kind, term.get());
      blocks[h]->WatchAlways();
      block_hold[h] = hold;
    }
    return *blocks[h];
  }

  void Forget() {
    for (const Hand& hand : hands) {
      for (const auto& [kind, term] : hand.skin_terms) term->Forget();
    }
  }

  std::vector<Hand> hands;
  std::array<std::unique_ptr<HandObjectBlock>, 2> blocks;
  std::array<std::unique_ptr<Slip>, 2> slips;
  std::array<int, 2> block_hold = {-1, -1};
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
    auto worker = std::make_unique<Worker>();
    for (std::size_t h = 0; h < problem.hands.size(); ++h) {
      worker->hands.push_back({std::make_unique<HandState>(*problem.hands[h]),
                               MakeSkinTerms(*anatomy_[h], problem.object, options)});
    }
    workers_.push_back(std::move(worker));
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
  Worker& worker = *workers_.front();
  for (const auto& held : frames_) {
    const auto k = static_cast<std::size_t>(held->hold);
    if (!terms_[k]->Slips()) continue;
    const ClipHold& hold = problem_.holds[k];
    const Slip& slip = *terms_[k]->SlipTerm();
    HandState& state = *worker.hands[static_cast<std::size_t>(hold.hand)].state;
    state.SetBody(held->body, problem_.source.trans.col(held->frame));
    state.Evaluate(held->fingers, false);
    if (held->frame == hold.begin) last[k] = slip.MarksOf(hold.at);
    held->marks = last[k];
    last[k] = slip.MarksOf(
        InObjectFrame(state.Vertices(),
                      Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(held->orientation)),
                      Eigen::Map<const Eigen::Vector3d>(held->translation)));
  }
}

void HoldEvaluation::EvaluateAll() {
  const auto count = static_cast<int>(frames_.size());
  ParallelFor((count + kChunk - 1) / kChunk, threads_, [&](int chunk) {
    std::unique_ptr<Worker> worker;
    {
      const std::lock_guard lock(mutex_);
      worker = std::move(workers_.back());
      workers_.pop_back();
    }
    worker->Forget();
    const int end = std::min(count, (chunk + 1) * kChunk);
    for (int k = chunk * kChunk; k < end; ++k) {
      Evaluate(*worker, *frames_[static_cast<std::size_t>(k)]);
    }
    const std::lock_guard lock(mutex_);
    workers_.push_back(std::move(worker));
  });
  evaluated_ = true;
}

void HoldEvaluation::Evaluate(Worker& worker, HoldCost& held) const {
  const ClipHold& hold = problem_.holds[static_cast<std::size_t>(held.hold)];
  const HoldTerms& terms = *terms_[static_cast<std::size_t>(held.hold)];
  HandState& state = *worker.hands[static_cast<std::size_t>(hold.hand)].state;
  HandObjectBlock& block = worker.Block(problem_, held.hold, terms);
  state.SetBody(held.body, problem_.source.trans.col(held.frame));
  block.Invalidate();
  if (terms.Slips()) {
    worker.slips[static_cast<std::size_t>(hold.hand)]->SetMarks(held.marks);
  }

  std::array<double*, 5> jacobians{};
  double* next = held.jacobians_.data();
  for (std::size_t b = 0; b < held.parameter_block_sizes().size(); ++b) {
    jacobians[b] = next;
    next += HandObjectBlock::kRows * held.parameter_block_sizes()[b];
  }
  const double* parameters[] = {held.orientation, held.translation, held.fingers.data(),
                                held.step.rotation.coeffs().data(), held.step.translation.data()};
  RelativePose seen{Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(held.orientation)),
                    Eigen::Map<const Eigen::Vector3d>(held.translation)};
  if (held.moves) {
    const WristOffsetBlock moved(&block, &state);
    held.finite_ = moved.Evaluate(parameters, held.residuals_.data(), jacobians.data());
    seen = SeenByUnmovedHand(state.WristRotation(), state.WristPosition(), seen.orientation,
                             seen.translation, held.step.rotation, held.step.translation);
  } else {
    held.finite_ = block.Evaluate(parameters, held.residuals_.data(), jacobians.data());
  }
  if (!held.finite_) return;

  const double* at[] = {seen.orientation.coeffs().data(), seen.translation.data(),
                        held.fingers.data()};
  held.energies = block.EnergiesAt(at);
}

}  // namespace holdfast
