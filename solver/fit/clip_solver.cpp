// SPDX-License-Identifier: MIT
#include "solver/fit/clip_solver.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include "solver/fit/hold_evaluation.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/object_motion.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

constexpr double kTurnLever = 0.1;  // meters: lever of rotations in E_a

// One Ceres problem over all frames, with initial wrists from `fitted`.
class WholeClip {
 public:
  WholeClip(const ClipProblem& problem, const FitOptions& options, int threads,
            std::vector<FittedFrame>& fitted)
      : problem_(problem),
        options_(options),
        fitted_(fitted),
        evaluation_(problem, options, threads),
        ceres_(ProblemOptions()) {
    for (std::size_t h = 0; h < problem.hands.size(); ++h) {
      limits_.push_back(MakeLimits(evaluation_.Axes(h), options));
    }
    AddHands();
    evaluation_.MarkContacts();
    AddGoals();
    if (problem.hands_give_way) {
      AddWristMotion();
    } else {
      AddObjectMotion();
    }
    AddFingerMotion();
    if (problem.first_frame_given) FixFirst();
  }

  // Returns whether there is a solution.
  bool Solve(const std::function<bool(int, int)>& progress, ClipReport& report) {
    // Ceres sums the results of its threads in order of completion. It runs on one thread; our
    // callback evaluates the hands in parallel, which takes most of the time.
    ceres::Solver::Options solver =
        SparseOptions(options_.max_iterations, options_.function_tolerance);
    solver.parameter_tolerance = options_.step_tolerance;
    StopWhenAsked callback(progress, solver.max_num_iterations);
    solver.callbacks.push_back(&callback);
    const ceres::Solver::Summary summary = SolveQuietly(solver, ceres_);
    report.iterations += summary.num_successful_steps + summary.num_unsuccessful_steps;
    report.cost_after = summary.final_cost;
    if (report.cost_before == 0.0) report.cost_before = summary.initial_cost;
    report.converged = summary.termination_type == ceres::CONVERGENCE;
    report.failed = summary.termination_type == ceres::FAILURE;
    return !report.failed && summary.termination_type != ceres::USER_FAILURE;
  }

  // Stores the solution, with energies at the current wrists.
  void Keep(ClipReport& report) {
    evaluation_.EvaluateAll();
    report.frames.assign(fitted_.size(), {});
    for (const auto& held : evaluation_.Frames()) {
      GraspPose& hand = fitted_[held->frame].hands[problem_.holds[held->hold].hand];
      hand.fingers = held->fingers;
      if (held->moves) hand.offset = hand.offset.Compose(held->step);
      report.frames[held->frame] += held->energies;
    }
  }

 private:
  ceres::Problem::Options ProblemOptions() {
    ceres::Problem::Options options = BorrowingProblem();
    options.evaluation_callback = &evaluation_;
    return options;
  }

  double* Orientation(int t) { return fitted_[t].object.orientation.coeffs().data(); }
  double* Translation(int t) { return fitted_[t].object.translation.data(); }

  template <typename Term>
  void Add(std::unique_ptr<Term> term, const std::vector<double*>& blocks) {
    ceres_.AddResidualBlock(term.get(), nullptr, blocks);
    terms_.push_back(std::move(term));
  }

  void AddHands() {
    const auto frames = fitted_.size();
    held_.assign(frames, {});
    wrists_.assign(frames, {Carrier::Identity(), Carrier::Identity()});
    solved_.assign(frames, false);
    for (std::size_t t = 0; t < frames; ++t) {
      std::vector<int> holds;
      for (std::size_t k = 0; k < problem_.holds.size(); ++k) {
        const ClipHold& hold = problem_.holds[k];
        if (static_cast<int>(t) >= hold.begin && static_cast<int>(t) < hold.end) {
          holds.push_back(static_cast<int>(k));
        }
      }
      if (holds.empty()) continue;
      JointPose body = problem_.source.pose[t];
      Eigen::Vector3d trans = problem_.source.trans.col(t);
      for (const int k : holds) {
        const int h = problem_.holds[k].hand;
        MoveHand(*problem_.hands[h], fitted_[t].hands[h].offset, trans, body);
      }
      BodyState joints;
      ForwardJoints(problem_.hands.front()->Surface().RestJoints(), body, trans, joints);
      for (const int k : holds) {
        const int h = problem_.holds[k].hand;
        const int wrist = WristJoint(problem_.hands[h]->HandSide());
        wrists_[t][h] = joints.WorldFromJoint(wrist);
        AddHand(k, static_cast<int>(t), h, body, holds.size() > 1);
      }
    }
  }

  void AddHand(int hold, int t, int h, const JointPose& body, bool together) {
    FittedFrame& frame = fitted_[t];
    const bool moves = (together || problem_.hands_give_way) && options_.lambda_wrist > 0.0;
    auto held = std::make_unique<HoldCost>(hold, t, frame, h, moves);
    held->body = body;
    double* const q = Orientation(t);
    double* const T = Translation(t);
    double* const P = held->fingers.data();
    Solved(t);
    std::vector<double*> blocks = {q, T, P};
    if (moves) {
      double* const C = held->step.rotation.coeffs().data();
      double* const c = held->step.translation.data();
      ceres_.AddParameterBlock(C, 4, &manifold_);
      blocks.insert(blocks.end(), {C, c});
      Add(std::make_unique<WristPrior>(frame.hands[h].offset, options_.lambda_wrist), {C, c});
    }
    ceres_.AddResidualBlock(held.get(), nullptr, blocks);
    if (limits_[h] != nullptr) ceres_.AddResidualBlock(limits_[h].get(), nullptr, P);
    if (options_.lambda_fingers > 0.0) {
      const FingerPose own = FingersOf(problem_.source.pose[t], problem_.hands[h]->HandSide());
      Add(std::make_unique<NearPoint>(own, options_.lambda_fingers), {P});
    }
    held_[t][h] = held.get();
    evaluation_.Frames().push_back(std::move(held));
  }

  // Makes the object pose of this frame an unknown.
  void Solved(int t) {
    if (solved_[t]) return;
    solved_[t] = true;
    ceres_.AddParameterBlock(Orientation(t), 4, &manifold_);
    ceres_.AddParameterBlock(Translation(t), 3);
    if (!problem_.hands_give_way) return;
    ceres_.SetParameterBlockConstant(Orientation(t));
    ceres_.SetParameterBlockConstant(Translation(t));
  }

  void AddGoals() {
    for (std::size_t k = 0; k < problem_.goals.size(); ++k) {
      const FrameGoal& goal = problem_.goals[k];
      const auto t = static_cast<int>(k);
      const auto add = [&](auto term) {
        Solved(t);
        Add(std::move(term), {Orientation(t), Translation(t)});
      };
      if (goal.data && options_.lambda_object > 0.0) {
        add(std::make_unique<ObjectData>(*goal.data, options_.lambda_object));
      }
      if (options_.lambda_support <= 0.0) continue;
      if (goal.rest) add(std::make_unique<ObjectData>(*goal.rest, options_.lambda_support));
      if (goal.support_height) {
        add(std::make_unique<Support>(problem_.object.vertices, *goal.support_height,
                                      options_.lambda_support));
      }
    }
  }

  bool HeldBy(int t) const {
    const auto& hands = held_[t];
    return hands[0] != nullptr || hands[1] != nullptr;
  }

  // Carrier of the object in frames [begin, end): a wrist that holds it in all of them, else the
  // world.
  std::vector<Carrier> Carriers(int begin, int end) const {
    for (std::size_t h = 0; h < problem_.hands.size(); ++h) {
      std::vector<Carrier> carriers;
      for (int t = begin; t < end && held_[t][h] != nullptr; ++t) {
        carriers.push_back(wrists_[t][h]);
      }
      if (static_cast<int>(carriers.size()) == end - begin) return carriers;
    }
    return std::vector<Carrier>(static_cast<std::size_t>(end - begin), Carrier::Identity());
  }

  void AddObjectMotion() {
    const auto frames = static_cast<int>(fitted_.size());
    const auto solved = [&](int t) { return solved_[t]; };
    const Carrier world = Carrier::Identity();
    for (int t = 0; t + 1 < frames; ++t) {
      if (!solved(t) || !solved(t + 1)) continue;
      if (options_.lambda_temporal > 0.0) {
        Add(std::make_unique<ObjectVelocity>(world, world, 1.0, options_.lambda_temporal),
            {Orientation(t), Translation(t), Orientation(t + 1), Translation(t + 1)});
      }
      if (options_.lambda_acceleration > 0.0 && t + 2 < frames && solved(t + 2)) {
        const std::vector<Carrier> carriers = Carriers(t, t + 3);
        // An object may start and stop where a hold starts or ends.
        const bool held = HeldBy(t) || HeldBy(t + 1) || HeldBy(t + 2);
        const bool in_world = carriers[1].matrix().isIdentity(0.0);
        const double weight = options_.lambda_acceleration * (held && in_world ? 0.05 : 1.0);
        Add(std::make_unique<ObjectAcceleration>(carriers[0], carriers[1], carriers[2], kTurnLever,
                                                 weight),
            {Orientation(t), Translation(t), Orientation(t + 1), Translation(t + 1),
             Orientation(t + 2), Translation(t + 2)});
      }
    }
  }

  // Penalizes acceleration of the wrist offsets. Steps are relative to the wrist without the
  // current offset of the body, so that the total offset is smooth.
  void AddWristMotion() {
    if (options_.lambda_acceleration <= 0.0) return;
    for (std::size_t h = 0; h < problem_.hands.size(); ++h) {
      for (std::size_t t = 0; t + 2 < fitted_.size(); ++t) {
        const std::array<HoldCost*, 3> held = {held_[t][h], held_[t + 1][h], held_[t + 2][h]};
        if (std::ranges::any_of(
                held, [](const HoldCost* one) { return one == nullptr || !one->moves; })) {
          continue;
        }
        const auto before = [&](std::size_t k) {
          const WristOffset& offset = fitted_[t + k].hands[h].offset;
          Carrier carrier = Carrier::Identity();
          carrier.linear() = offset.rotation.toRotationMatrix();
          carrier.translation() = offset.translation;
          return Carrier(carrier.inverse());
        };
        std::vector<double*> blocks;
        for (HoldCost* const one : held) {
          blocks.insert(blocks.end(),
                        {one->step.rotation.coeffs().data(), one->step.translation.data()});
        }
        Add(std::make_unique<ObjectAcceleration>(before(0), before(1), before(2), kTurnLever,
                                                 options_.lambda_acceleration),
            blocks);
      }
    }
  }

  // Hands that are adjusted are smoothed across all frames in a row, whatever their holds.
  bool GoesOn(const HoldCost& a, const HoldCost& b) const {
    return a.hold == b.hold || problem_.hands_give_way;
  }

  void AddFingerMotion() {
    for (std::size_t h = 0; h < problem_.hands.size(); ++h) {
      for (std::size_t t = 0; t + 1 < fitted_.size(); ++t) {
        HoldCost* const a = held_[t][h];
        HoldCost* const b = held_[t + 1][h];
        if (a == nullptr || b == nullptr || !GoesOn(*a, *b)) continue;
        if (options_.lambda_temporal > 0.0) {
          Add(std::make_unique<FingerDifference>(std::vector{-1.0, 1.0}, 1.0,
                                                 options_.lambda_temporal),
              {a->fingers.data(), b->fingers.data()});
        }
        if (options_.lambda_acceleration <= 0.0 || t + 2 >= fitted_.size()) continue;
        HoldCost* const c = held_[t + 2][h];
        if (c == nullptr || !GoesOn(*a, *c)) continue;
        Add(std::make_unique<FingerDifference>(std::vector{1.0, -2.0, 1.0}, kTurnLever,
                                               options_.lambda_acceleration),
            {a->fingers.data(), b->fingers.data(), c->fingers.data()});
      }
    }
  }

  void FixFirst() {
    if (fitted_.empty() || !solved_[0]) return;
    ceres_.SetParameterBlockConstant(Orientation(0));
    ceres_.SetParameterBlockConstant(Translation(0));
    for (HoldCost* held : held_[0]) {
      if (held == nullptr) continue;
      ceres_.SetParameterBlockConstant(held->fingers.data());
      if (!held->moves) continue;
      ceres_.SetParameterBlockConstant(held->step.rotation.coeffs().data());
      ceres_.SetParameterBlockConstant(held->step.translation.data());
    }
  }

  const ClipProblem& problem_;
  const FitOptions& options_;
  std::vector<FittedFrame>& fitted_;
  RotationManifold manifold_;
  HoldEvaluation evaluation_;
  std::vector<std::unique_ptr<HandPriorTerm>> limits_;  // per hand, null when off
  std::vector<std::unique_ptr<ceres::CostFunction>> terms_;
  std::vector<std::array<HoldCost*, 2>> held_;  // per frame and hand, null if it does not hold
  std::vector<std::array<Carrier, 2>> wrists_;  // per frame and holding hand
  std::vector<bool> solved_;                    // per frame: the object pose is an unknown
  ceres::Problem ceres_;
};

}  // namespace

ClipReport SolveClip(const ClipProblem& problem, const FitOptions& options, int threads,
                     std::vector<FittedFrame>& fitted,
                     const std::function<bool(int, int)>& progress) {
  const auto begin = std::chrono::steady_clock::now();
  ClipReport report;
  // A hand that moves as a whole bends at its wrist when the arm follows, so a second round solves
  // with the updated arms. Slipping contacts are dragged towards their positions in the preceding
  // frame, from the round before.
  bool together = problem.hands_give_way, slips = false;
  for (const ClipHold& a : problem.holds) {
    slips |= a.slip;
    for (const ClipHold& b : problem.holds) {
      together |= a.hand < b.hand && a.begin < b.end && b.begin < a.end;
    }
  }
  const int rounds = slips || (together && options.lambda_wrist > 0.0) ? 2 : 1;
  for (int round = 0; round < rounds; ++round) {
    std::vector<FittedFrame> solution = fitted;
    WholeClip whole(problem, options, threads, solution);
    if (!whole.Solve(progress, report)) break;
    whole.Keep(report);
    fitted = std::move(solution);
  }
  report.solve_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace holdfast
