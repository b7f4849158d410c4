// SPDX-License-Identifier: MIT
#include "solver/fit/fit.h"

#include <algorithm>
#include <string>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_solver.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

void Check(const Clip& clip, std::span<const HandModel* const> hands, const FitObject& object,
           std::span<const std::uint8_t> holding) {
  if (!clip.object) {
    throw Error("clip", "has no object: its first frame must hold one",
                "Make a grasp first, or give a clip with object_trans and object_orient");
  }
  if (object.vertices.cols() == 0) {
    throw Error("object", "has no vertices", "Give a mesh with a surface");
  }
  if (static_cast<int>(holding.size()) != clip.NumFrames()) {
    throw Error("holding_hand",
                "has " + std::to_string(holding.size()) + " frames, but the clip has " +
                    std::to_string(clip.NumFrames()),
                "Give one number (1 right, 2 left, 3 both) for each frame");
  }
  std::uint8_t known = 0;
  for (const HandModel* hand : hands) known |= HoldingBit(hand->HandSide());
  for (const std::uint8_t bits : holding) {
    if ((bits & ~known) != 0) {
      throw Error("holding_hand", "names a hand that the fit was not given",
                  "Fit with both hands, or say which one holds");
    }
  }
}

// Holds of each hand in the fitted frames.
std::vector<ClipHold> HoldsOf(const Clip& clip, std::span<const HandModel* const> hands,
                              std::span<const std::uint8_t> holding,
                              std::span<const FittedFrame> fitted, bool slip) {
  std::vector<ClipHold> holds;
  const auto frames = static_cast<int>(fitted.size());
  for (std::size_t h = 0; h < hands.size(); ++h) {
    const std::uint8_t bit = HoldingBit(hands[h]->HandSide());
    HandState state(*hands[h]);
    for (int t = 0; t < frames; ++t) {
      if ((holding[t] & bit) == 0) continue;
      ClipHold hold{static_cast<int>(h), t, t, {}, slip};
      const FittedFrame& first = fitted[t];
      JointPose body = clip.pose[t];
      Eigen::Vector3d trans = clip.trans.col(t);
      MoveHand(*hands[h], first.hands[h].offset, trans, body);
      state.SetBody(body, trans);
      state.Evaluate(first.hands[h].fingers, false);
      hold.at = InObjectFrame(state.Vertices(), first.object.orientation, first.object.translation);
      while (t < frames && (holding[t] & bit) != 0) ++t;
      hold.end = t;
      holds.push_back(std::move(hold));
    }
  }
  return holds;
}

// Solves all frames again, jointly, from the frame-by-frame solution.
void FitWholeClip(const Clip& clip, std::span<const HandModel* const> hands,
                  const FitObject& object, std::span<const std::uint8_t> holding,
                  const FitOptions& options, std::vector<FittedFrame>& fitted,
                  std::vector<FrameReport>& reports, const std::function<bool()>& go_on) {
  const auto frames = static_cast<int>(fitted.size());
  ClipProblem problem{clip, hands, object, HoldsOf(clip, hands, holding, fitted, options.slip),
                      {},   true};
  problem.goals.resize(fitted.size());
  for (int t = 0; t < frames; ++t) {
    if (holding[t] == 0) {
      problem.goals[t].rest = fitted[t].object;
    } else if (options.lambda_object > 0.0) {
      problem.goals[t].data = ObjectPose(clip.object->Pose(t));
    }
  }
  const ClipReport whole = SolveClip(problem, options, options.threads, fitted,
                                     [&](int, int) { return !go_on || go_on(); });
  if (whole.frames.empty()) return;
  for (int t = 1; t < frames; ++t) {
    FrameReport& report = reports[t];
    report.energies = whole.frames[t];
    double& temporal = report.energies[EnergyTerm::kTemporal];
    report.wrist_offset_m = 0.0;
    if (holding[t] != 0) {
      const FittedFrame &before = fitted[t - 1], &now = fitted[t];
      temporal =
          (now.object.translation - before.object.translation).squaredNorm() +
          LogSO3(
              (before.object.orientation.conjugate() * now.object.orientation).toRotationMatrix())
              .squaredNorm();
      for (std::size_t h = 0; h < hands.size(); ++h) {
        const std::uint8_t bit = HoldingBit(hands[h]->HandSide());
        if ((holding[t] & bit) == 0) continue;
        report.wrist_offset_m =
            std::max(report.wrist_offset_m, now.hands[h].offset.translation.norm());
        if ((holding[t - 1] & bit) == 0) continue;
        temporal += (now.hands[h].fingers - before.hands[h].fingers).squaredNorm();
      }
      report.stop = whole.converged ? StopReason::kConverged : StopReason::kIterationLimit;
      report.iterations += whole.iterations;
    }
    report.solve_ms += whole.solve_ms / frames;
    report.energy_total = report.energies.Total(options);
  }
}

}  // namespace

FitResult FitClip(const Clip& clip, std::span<const HandModel* const> hands,
                  const FitObject& object, std::span<const std::uint8_t> holding,
                  const FitOptions& options, const GraspMaker& grasps,
                  const std::function<bool(int, int)>& progress) {
  Check(clip, hands, object, holding);
  if (options.whole_clip && options.normalize != Normalization::kSum) {
    throw Error("whole_clip", "supports only the sums of E_c and E_t, not their means",
                "Fit without whole_clip, or normalize by sums");
  }
  if (options.whole_clip && !options.custom_terms.empty()) {
    throw Error("whole_clip", "solves all frames at once, but custom terms apply to single frames",
                "Fit without whole_clip, or without custom terms");
  }
  const int frames = clip.NumFrames();
  FitResult result;
  for (const CustomTerm& term : options.custom_terms) result.custom_terms.push_back(term.name);
  const ObjectTrack& track = *clip.object;
  FrameFitter fitter(hands, object, options, 1.0 / clip.frame_rate);
  fitter.Place(ObjectPose(track.Pose(0)));
  std::vector<FittedFrame> fitted;

  for (int t = 0; t < frames; ++t) {
    const Eigen::Vector3d trans = clip.trans.col(t);
    if (progress && t > 0 && !progress(t, frames)) break;
    const std::uint8_t before = t == 0 ? 0 : holding[t - 1];
    // A hand's hold ends in the frame before, unless the other hand only takes the object now.
    for (const HandModel* hand : hands) {
      const std::uint8_t bit = HoldingBit(hand->HandSide());
      const bool last = (before & ~bit) == 0;
      if ((before & bit) != 0 && (holding[t] & bit) == 0 && !(last && holding[t] != 0)) {
        fitter.Release(hand->HandSide());
      }
    }
    FrameReport report;
    if (options.lambda_object > 0.0) {
      fitter.Guide(ObjectPose(clip.object->Pose(t)));
    }
    if (t > 0) report = fitter.Solve(clip.pose[t], trans);
    for (const HandModel* hand : hands) {
      const Side side = hand->HandSide();
      if ((before & HoldingBit(side)) != 0 || (holding[t] & HoldingBit(side)) == 0) continue;
      GraspPose grasp{FingersOf(clip.pose[t], side), {}};
      if (grasps) {
        grasp = grasps({t, side, t == 0 ? clip.pose[0] : fitter.Body(), trans, fitter.Object()});
      } else if (t > 0) {
        throw Error("holding_hand",
                    "has a hand that starts to hold the object in frame " + std::to_string(t) +
                        ", but no grasp is given",
                    "Use 'holdfast offhand', or start the clip where the hand already holds");
      }
      fitter.TakeHold(side, clip.pose[t], trans, grasp.fingers, grasp.offset);
      const bool alone = std::ranges::all_of(hands, [&](const HandModel* other) {
        return other == hand || !fitter.Hand(other->HandSide()).Holds();
      });
      fitter.Refine(side, clip.pose[t], trans, alone && (holding[t] & ~HoldingBit(side)) == 0);
      result.num_contact_pairs += fitter.Hand(side).NumContactPairs();
    }
    for (const HandModel* hand : hands) {
      const std::uint8_t bit = HoldingBit(hand->HandSide());
      if ((before & bit) != 0 && (holding[t] & bit) == 0 && fitter.Hand(hand->HandSide()).Holds()) {
        fitter.Release(hand->HandSide());
      }
    }
    if (t == 0) report = fitter.FirstFrame();
    result.frames.push_back(report);
    FittedFrame& frame = fitted.emplace_back();
    frame.object = fitter.Object();
    for (std::size_t h = 0; h < hands.size(); ++h) {
      const FittedHand& hand = fitter.Hand(hands[h]->HandSide());
      frame.hands[h] = {hand.fingers, hand.offset};
    }
  }

  const auto done = static_cast<int>(fitted.size());
  if (options.whole_clip && done == frames) {
    FitWholeClip(clip, hands, object, holding, options, fitted, result.frames,
                 [&] { return !progress || progress(frames - 1, frames); });
  }
  result.clip = ApplyFit(clip, hands, holding, fitted, options.release_s);
  if (progress) progress(done, frames);
  return result;
}

}  // namespace holdfast
