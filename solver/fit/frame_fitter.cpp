// SPDX-License-Identifier: MIT
#include "solver/fit/frame_fitter.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <ceres/problem.h>

#include <fmt/format.h>

#include "solver/fit/fitted_hand.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/dense_problem.h"
#include "solver/unknowns/rotation_manifold.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {
namespace {

// Data of one hand while a frame is solved.
struct HandBlocks {
  std::optional<Temporal> temporal;
  std::optional<NearPoint> finger_temporal;
  std::optional<NearPoint> finger_data;
  std::optional<WristOffsetBlock> moved;
  std::optional<WristPrior> prior, calm;
  WristOffset step;
  FingerPose fingers_before;
};

WristFrame Wrist(const FittedHand& hand) {
  return {hand.State().WristRotation(), hand.State().WristPosition()};
}

Eigen::Isometry3d Transform(const WristFrame& wrist) {
  return RigidTransform(wrist.rotation, wrist.position);
}

// Offset that keeps a hand in place on the object, which moves from `from` to `to`; the wrist was
// at `before` and is at `now` without an offset.
WristOffset Carried(const WristFrame& before, const WristFrame& now, const ObjectPose& from,
                    const ObjectPose& to) {
  const Eigen::Isometry3d offset =
      Transform(now).inverse() * to.Transform() * from.Transform().inverse() * Transform(before);
  return {Eigen::Quaterniond(offset.linear()).normalized(), offset.translation()};
}

// Midpoint of two poses.
ObjectPose Middle(const ObjectPose& a, const ObjectPose& b) {
  return {a.orientation.slerp(0.5, b.orientation).normalized(),
          0.5 * (a.translation + b.translation)};
}

// Decays an offset that is no longer needed: the hand returns to its pose in the clip.
void EaseOffset(const FitOptions& options, double frame_s, WristOffset& offset) {
  if (offset.IsZero()) return;
  offset = offset.Scaled(std::exp(-frame_s / std::max(options.release_s, 1e-3)));
  if (offset.translation.norm() + WristPrior::kLever * offset.rotation.vec().norm() < 1e-5) {
    offset = {};
  }
}

// Problem of one frame: moves the object, the fingers of holding hands and, where two hold, their
// wrists. Hands and object are those of the fitter and change in place.
class FrameProblem {
 public:
  FrameProblem(const FitOptions& options, double frame_s, const std::vector<FittedHand*>& holding,
               ObjectPose& object)
      : options_(options), frame_s_(frame_s), holding_(holding), object_(object), start_(object) {
    for (FittedHand* hand : holding) problem_.AddParameterBlock(hand->fingers.data(), kHandDofs);
    problem_.AddParameterBlock(Q(), 4, true);
    problem_.AddParameterBlock(T(), 3);
  }
  FrameProblem(const FrameProblem&) = delete;
  FrameProblem& operator=(const FrameProblem&) = delete;

  void AddGuide(const ObjectPose& guide) {
    data_.emplace(guide, options_.lambda_object);
    problem_.AddResidualBlock(*data_, {Q(), T()});
  }

  // Adds the k-th hand, with its wrist starting at `step`. `previous`: object in the last frame;
  // `pose`: the clip's in this frame.
  void AddHand(std::size_t k, const WristOffset& step, const ObjectPose& previous,
               const JointPose& pose) {
    FittedHand& hand = *holding_[k];
    HandBlocks& own = blocks_[k];
    double* const p = hand.fingers.data();
    own.fingers_before = hand.fingers;
    own.step = step;
    hand.Watch(object_, own.step);
    if (holding_.size() > 1) {
      AddMovedHold(hand, own);
    } else {
      problem_.AddResidualBlock(hand.Block(), {Q(), T(), p});
    }
    if (k == 0) {
      own.temporal.emplace(previous.orientation, previous.translation, hand.fingers,
                           hand.TemporalWeight());
      problem_.AddResidualBlock(*own.temporal, {Q(), T(), p});
    } else {
      own.finger_temporal.emplace(hand.fingers, hand.TemporalWeight());
      problem_.AddResidualBlock(*own.finger_temporal, {p});
    }
    if (options_.lambda_fingers > 0.0) {
      own.finger_data.emplace(FingersOf(pose, hand.HandSide()), options_.lambda_fingers);
      problem_.AddResidualBlock(*own.finger_data, {p});
    }
    if (hand.Limits() != nullptr) problem_.AddResidualBlock(*hand.Limits(), {p});
  }

  // User-defined terms; call after adding the hands.
  void AddCustomTerms(const CustomTermFrame& frame) {
    for (const CustomTerm& term : options_.custom_terms) {
      std::vector<double*>& parameters = custom_parameters_.emplace_back();
      for (const FitBlock block : term.blocks) parameters.push_back(FindBlock(block));
      custom_.emplace_back();
      if (std::ranges::find(parameters, nullptr) != parameters.end()) continue;
      custom_.back() = std::make_unique<GuardedTerm>(term, frame);
      if (custom_.back()->Acts()) problem_.AddResidualBlock(*custom_.back(), parameters);
    }
  }

  // Sets iterations, stop reason and energies of custom terms. Resets a frame that failed.
  void Solve(FrameReport& report) {
    const auto find_fault = [&] {
      for (std::size_t k = 0; k < custom_.size(); ++k) {
        if (custom_[k] == nullptr || custom_[k]->Fault().empty()) continue;
        report.fault =
            fmt::format("custom term '{}' {}", options_.custom_terms[k].name, custom_[k]->Fault());
        return true;
      }
      return false;
    };
    if (find_fault()) {
      report.stop = StopReason::kFailed;
      Restore();
      return;
    }
    // Terms that watch only some points may find that the hand has moved to where they did not
    // look.
    constexpr int kRounds = 3;
    const ceres::Solver::Options options = FrameSolverOptions(options_);
    ceres::Solver::Summary solved;
    for (int round = 0; round < kRounds; ++round) {
      solved = problem_.Solve(options);
      report.iterations += StepsOf(solved);
      if (solved.termination_type == ceres::FAILURE) break;
      bool anew = false;
      for (std::size_t k = 0; k < holding_.size(); ++k) {
        anew |= holding_[k]->Watch(object_, blocks_[k].step);
      }
      if (!anew) break;
    }
    switch (solved.termination_type) {
      case ceres::CONVERGENCE:
      case ceres::USER_SUCCESS:
        report.stop = StopReason::kConverged;
        break;
      case ceres::NO_CONVERGENCE:
        report.stop = StopReason::kIterationLimit;
        break;
      default:
        report.stop = StopReason::kFailed;
        find_fault();
        Restore();
    }
    for (std::size_t k = 0; k < custom_.size(); ++k) {
      if (custom_[k] != nullptr)
        report.custom_energies[k] = custom_[k]->Energy(custom_parameters_[k].data());
    }
  }

  const WristOffset& Step(std::size_t k) const { return blocks_[k].step; }
  const FingerPose& FingersBefore(std::size_t k) const { return blocks_[k].fingers_before; }

 private:
  double* Q() { return object_.orientation.coeffs().data(); }
  double* T() { return object_.translation.data(); }

  // Terms between the object and a hand whose wrist may deviate from the clip.
  void AddMovedHold(FittedHand& hand, HandBlocks& own) {
    double* const C = own.step.rotation.coeffs().data();
    double* const c = own.step.translation.data();
    own.moved.emplace(&hand.Block(), &hand.State());
    problem_.AddResidualBlock(*own.moved, {Q(), T(), hand.fingers.data(), C, c});
    if (!(options_.lambda_wrist > 0.0)) return;  // the wrist stays where it is
    problem_.AddParameterBlock(C, 4, true);
    problem_.AddParameterBlock(c, 3);
    own.prior.emplace(hand.offset, options_.lambda_wrist);
    problem_.AddResidualBlock(*own.prior, {C, c});
    // Hands that start a hold off the clip's wrists return there within release_s, not at once.
    own.calm.emplace(WristOffset{}, options_.lambda_wrist * options_.release_s / frame_s_);
    problem_.AddResidualBlock(*own.calm, {C, c});
  }

  void Restore() {
    object_ = start_;
    for (std::size_t k = 0; k < holding_.size(); ++k) {
      holding_[k]->fingers = blocks_[k].fingers_before;
      blocks_[k].step = {};
    }
  }

  // Null if the hand does not hold.
  double* FindBlock(FitBlock block) {
    if (block == FitBlock::kObjectRotation) return Q();
    if (block == FitBlock::kObjectTranslation) return T();
    const bool right = block == FitBlock::kRightFingers || block == FitBlock::kRightWristRotation ||
                       block == FitBlock::kRightWristTranslation;
    for (std::size_t k = 0; k < holding_.size(); ++k) {
      if ((holding_[k]->HandSide() == Side::kRight) != right) continue;
      switch (block) {
        case FitBlock::kRightFingers:
        case FitBlock::kLeftFingers:
          return holding_[k]->fingers.data();
        case FitBlock::kRightWristRotation:
        case FitBlock::kLeftWristRotation:
          return blocks_[k].step.rotation.coeffs().data();
        default:
          return blocks_[k].step.translation.data();
      }
    }
    return nullptr;
  }

  const FitOptions& options_;
  double frame_s_;
  const std::vector<FittedHand*>& holding_;
  ObjectPose& object_;
  ObjectPose start_;
  std::optional<ObjectData> data_;
  std::array<HandBlocks, 2> blocks_;
  std::vector<std::unique_ptr<GuardedTerm>>
      custom_;  // of FitOptions::custom_terms, null if inactive
  std::vector<std::vector<double*>> custom_parameters_;
  DenseProblem problem_;
};

}  // namespace

std::string_view StopReasonName(StopReason reason) {
  constexpr const char* kNames[] = {"given", "resting", "converged", "iteration_limit", "failed"};
  return kNames[static_cast<std::size_t>(reason)];
}

ceres::Solver::Options FrameSolverOptions(const FitOptions& options) {
  return DenseOptions(options.max_iterations, options.step_tolerance, options.function_tolerance);
}

ObjectPose FollowWrist(const ObjectPose& object, const WristFrame& from, const WristFrame& to) {
  const Eigen::Matrix3d turn = to.rotation * from.rotation.transpose();
  return {(Eigen::Quaterniond(turn) * object.orientation).normalized(),
          turn * (object.translation - from.position) + to.position};
}

FrameFitter::FrameFitter(std::span<const HandModel* const> hands, const FitObject& object,
                         const FitOptions& options, double frame_s)
    : options_(options), frame_s_(frame_s) {
  CheckCustomTerms(options.custom_terms);
  for (const HandModel* hand : hands) {
    hands_.push_back(std::make_unique<FittedHand>(*hand, object, options));
  }
  body_.setZero();
}

FittedHand& FrameFitter::Find(Side side) const {
  const auto found =
      std::ranges::find_if(hands_, [&](const auto& hand) { return hand->HandSide() == side; });
  assert(found != hands_.end());
  return **found;
}

// Sets the clip's pose with the arms at the hands' offsets.
void FrameFitter::SetBody(const JointPose& pose, const Eigen::Vector3d& trans) {
  body_ = pose;
  Eigen::Vector3d moved = trans;
  for (const auto& hand : hands_) {
    if (!hand->Holds() || hand->offset.IsZero()) continue;
    MoveHand(hand->State().Hand(), hand->offset, moved, body_);
  }
  for (const auto& hand : hands_) {
    if (hand->Holds()) hand->SetBody(body_, moved);
  }
}

void FrameFitter::TakeHold(Side side, const JointPose& pose, const Eigen::Vector3d& trans,
                           const FingerPose& fingers, const WristOffset& offset) {
  FittedHand& hand = Find(side);
  hand.offset = offset;
  JointPose body = pose;
  Eigen::Vector3d moved = trans;
  MoveHand(hand.State().Hand(), offset, moved, body);
  hand.SetBody(body, moved);
  hand.TakeHold(fingers, object_);
  body_ = pose;
  SetBody(pose, trans);
  for (const auto& held : hands_) {
    if (held->Holds()) SetFingers(body_, held->HandSide(), held->fingers);
  }
}

void FrameFitter::Release(Side side) { Find(side).Release(); }

void FrameFitter::Refine(Side side, const JointPose& pose, const Eigen::Vector3d& trans,
                         bool move_object) {
  // E_d keeps the hand at the start of the hold: each round starts from the previous one.
  constexpr int kRounds = 6;
  constexpr double kContent = 1e-8;  // m^2: 0.1 mm too deep in one place
  FittedHand& hand = Find(side);
  for (int round = 0; round < kRounds; ++round) {
    hand.Watch(object_, {});
    const Energies energies = hand.EnergiesAt(object_);
    if (energies[EnergyTerm::kPenetration] + energies[EnergyTerm::kObjectInHand] < kContent) return;
    RotationManifold manifold;
    ceres::Problem problem(BorrowingProblem());
    ObjectPose object = object_;
    FingerPose fingers = hand.fingers;
    WristOffset step;
    double* const q = object.orientation.coeffs().data();
    double* const T = object.translation.data();
    double* const C = step.rotation.coeffs().data();
    problem.AddParameterBlock(q, 4, &manifold);
    problem.AddParameterBlock(C, 4, &manifold);
    WristOffsetBlock block(&hand.Block(), &hand.State());
    problem.AddResidualBlock(&block, nullptr, q, T, fingers.data(), C, step.translation.data());
    if (hand.Limits() != nullptr) {
      problem.AddResidualBlock(hand.Limits(), nullptr, fingers.data());
    }
    if (move_object) {
      problem.SetParameterBlockConstant(C);
      problem.SetParameterBlockConstant(step.translation.data());
    } else {
      problem.SetParameterBlockConstant(q);
      problem.SetParameterBlockConstant(T);
    }
    if (!SolveQuietly(FrameSolverOptions(options_), problem).IsSolutionUsable()) return;
    object_ = object;
    TakeHold(side, pose, trans, fingers, hand.offset.Compose(step));
  }
}

FrameReport FrameFitter::Solve(const JointPose& pose, const Eigen::Vector3d& trans) {
  const auto begin = std::chrono::steady_clock::now();
  FrameReport report;
  ++frame_;
  report.custom_energies.assign(options_.custom_terms.size(),
                                std::numeric_limits<double>::quiet_NaN());
  std::vector<FittedHand*> holding;
  for (const auto& hand : hands_) {
    if (hand->Holds()) holding.push_back(hand.get());
  }
  if (holding.empty()) {
    body_ = pose;
    report.stop = StopReason::kResting;
    return report;
  }
  const bool together = holding.size() > 1;
  if (!together) EaseOffset(options_, frame_s_, holding[0]->offset);
  std::array<WristFrame, 2> before;
  for (std::size_t k = 0; k < holding.size(); ++k) before[k] = Wrist(*holding[k]);
  SetBody(pose, trans);
  const ObjectPose previous = object_;
  object_ = FollowWrist(previous, before[0], Wrist(*holding[0]));
  if (together) object_ = Middle(object_, FollowWrist(previous, before[1], Wrist(*holding[1])));

  FrameProblem problem(options_, frame_s_, holding, object_);
  if (guide_ && options_.lambda_object > 0.0) problem.AddGuide(*guide_);
  for (std::size_t k = 0; k < holding.size(); ++k) {
    // The hands start in place on the object, so that only the correction remains to be shared.
    const bool carried = together && options_.lambda_wrist > 0.0;
    problem.AddHand(
        k, carried ? Carried(before[k], Wrist(*holding[k]), previous, object_) : WristOffset{},
        previous, pose);
  }
  problem.AddCustomTerms({frame_, frame_ * frame_s_, object_, pose, trans});
  problem.Solve(report);
  if (together) {
    for (std::size_t k = 0; k < holding.size(); ++k) {
      holding[k]->offset = holding[k]->offset.Compose(problem.Step(k));
    }
    SetBody(pose, trans);
  }
  for (std::size_t k = 0; k < holding.size(); ++k) {
    report.energies[EnergyTerm::kTemporal] +=
        (holding[k]->fingers - problem.FingersBefore(k)).squaredNorm();
    SetFingers(body_, holding[k]->HandSide(), holding[k]->fingers);
    report.wrist_offset_m = std::max(report.wrist_offset_m, holding[k]->offset.translation.norm());
  }
  report.energies[EnergyTerm::kTemporal] +=
      LogSO3((previous.orientation.conjugate() * object_.orientation).toRotationMatrix())
          .squaredNorm() +
      (object_.translation - previous.translation).squaredNorm();
  FillEnergies(report);
  for (FittedHand* hand : holding) hand->Keep(object_);
  report.solve_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

void FrameFitter::FillEnergies(FrameReport& report) {
  double beyond = 0.0;  // contribution of normalized weights to the total
  for (const auto& hand : hands_) {
    if (!hand->Holds()) continue;
    const Energies& energies = hand->EnergiesAt(object_);
    report.energies += energies;
    beyond += (hand->ContactWeight() - options_.lambda_contact) * energies[EnergyTerm::kContact];
  }
  beyond += (hands_.front()->TemporalWeight() - options_.lambda_temporal) *
            report.energies[EnergyTerm::kTemporal];
  report.energy_total = report.energies.Total(options_) + beyond;
  for (std::size_t k = 0; k < report.custom_energies.size(); ++k) {
    if (std::isnan(report.custom_energies[k])) continue;
    report.energy_total += options_.custom_terms[k].weight * report.custom_energies[k];
  }
}

FrameReport FrameFitter::FirstFrame() {
  FrameReport report;
  report.custom_energies.assign(options_.custom_terms.size(),
                                std::numeric_limits<double>::quiet_NaN());
  for (const auto& hand : hands_) {
    if (hand->Holds()) hand->Watch(object_, {});
  }
  FillEnergies(report);
  return report;
}

int FrameFitter::NumContactPairs() const {
  int pairs = 0;
  for (const auto& hand : hands_) pairs += hand->Holds() ? hand->NumContactPairs() : 0;
  return pairs;
}

}  // namespace holdfast
