// SPDX-License-Identifier: MIT
#include "solver/take/take.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/score/hand_object_score.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

constexpr int kAttempts = 3;
constexpr int kLookedAt = 4;             // motions per attempt for which a table is placed
constexpr double kLaterMotion = 0.03;    // of score: the motion maker puts its best first
constexpr double kBodyInTable_m = 0.02;  // more than this may be fixed by another attempt
constexpr double kLedByHand =
    2000.0;  // FitOptions::lambda_object: relative to the object's motion with the hand
constexpr double kMissed_m = 0.02;  // a hand farther from the grasp holds nothing

// A motion that takes the object, and a table that avoids the body.
struct Candidate {
  TakeMotion motion;
  TablePlacement table;
  int attempt = 0;
  int index = 0;  // within its attempt
  double score = -1e9;

  bool Serves() const { return motion.fault.empty() && table.deepest_m <= kBodyInTable_m; }
};

// Returns the best motion of an attempt.
Candidate BestOf(const std::vector<TakeBodyMotion>& motions, const TakePlan& plan,
                 const HandModel& hand, const BodySurface& body, const TakeObject& object,
                 const Clip& like, int threads) {
  std::vector<Candidate> all;
  all.resize(motions.size());
  ParallelFor(static_cast<int>(motions.size()), threads, [&](int i) {
    all[i].motion = MakeTakeMotion(plan, motions[i], hand, object, like);
    all[i].index = i;
    all[i].score = all[i].motion.score - kLaterMotion * i;
  });
  std::ranges::stable_sort(
      all, [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  Candidate best;
  best.motion.fault = "no motion was generated";
  for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), kLookedAt); ++i) {
    if (all[i].motion.clip.NumFrames() == 0) {
      if (i == 0) best = std::move(all[i]);
      continue;
    }
    const Eigen::Vector3d place = plan.places.front();
    all[i].table = PlaceTable(place, plan.approach_yaw_rad, TableMargin(object.mesh),
                              SkinNearTable(all[i].motion.clip, body, place, threads));
    all[i].score -= 100.0 * all[i].table.deepest_m;
    if (all[i].score > best.score) best = std::move(all[i]);
  }
  return best;
}

// Measures the drift of the held object: of its pose in the wrist's frame from that of the grasp.
void MeasureWandering(const BodySurface& body, Side side, TakeReport& report) {
  const Clip& clip = report.clip;
  const Eigen::Isometry3d& grasp = report.motion.take.grasp.wrist_from_object;
  BodyState state;
  for (int t = report.motion.times.take; t < clip.NumFrames(); ++t) {
    ForwardJoints(body.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    const int wrist = WristJoint(side);
    const Eigen::Matrix3d rotation =
        state.world_rotation[wrist].transpose() * ExpSO3(clip.object->orient.col(t));
    const Eigen::Vector3d position = state.world_rotation[wrist].transpose() *
                                     (clip.object->trans.col(t) - state.joints.col(wrist));
    report.wanders_mm =
        std::max(report.wanders_mm, 1000.0 * (position - grasp.translation()).norm());
    report.wanders_deg =
        std::max(report.wanders_deg, AngleBetween(rotation, grasp.linear()) / kDegree);
  }
}

// All stages of one take.
class TakePipeline {
 public:
  TakePipeline(const TakeRequest& request, const TakeStart& start, const PreparedObject& prepared,
               const StagedProgress& progress)
      : request_(request),
        start_(start),
        prepared_(prepared),
        progress_(progress),
        object_{prepared.object.mesh, prepared.solid.distance, *prepared.fit.distance},
        hand_(start.body, start.betas, request.side),
        body_(start.body, start.betas) {
    request_.pelvis = start.pelvis;
  }

  TakeReport Run(const BodyMotionMaker& motion) {
    report_.plan = PlanTake(request_, hand_, object_, [&](double share) {
      return GoesOn("grasp", static_cast<int>(100 * share), 100);
    });
    if (stopped_) return std::move(report_);
    if (!report_.plan.Found()) return Ended(TakeStatus::kNoGrasp);
    if (!report_.plan.take.fault.empty()) {
      report_.notes.push_back("no grasp meets all conditions: " + report_.plan.take.fault);
    }
    ChooseMotion(motion);
    if (stopped_) return std::move(report_);
    const TakeMotion& chosen = report_.motion;
    if (chosen.clip.NumFrames() == 0) return Ended(TakeStatus::kNoMotion);
    if (chosen.take_wrist_error_m > kMissed_m) return Ended(TakeStatus::kMissed);
    if (!chosen.fault.empty()) report_.notes.push_back("while taking the object: " + chosen.fault);
    Fit();
    if (stopped_) return std::move(report_);
    Measure();
    if (stopped_) return std::move(report_);
    return Ended(TakeStatus::kTaken);
  }

 private:
  TakeReport Ended(TakeStatus status) {
    report_.status = status;
    return std::move(report_);
  }

  bool GoesOn(const char* stage, int done, int total) {
    if (progress_ && !progress_(stage, done, total)) stopped_ = true;
    return !stopped_;
  }

  void ChooseMotion(const BodyMotionMaker& motion) {
    Candidate best;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::vector<TakeBodyMotion> motions = motion(report_.plan, attempt);
      if (!GoesOn("motion", attempt + 1, kAttempts)) return;
      Candidate found =
          BestOf(motions, report_.plan, hand_, body_, object_, start_.like, request_.threads);
      found.attempt = attempt;
      if (attempt == 0 || found.score > best.score) best = std::move(found);
      if (best.Serves()) break;
    }
    report_.motion = std::move(best.motion);
    report_.table = best.table.table;
    report_.attempt = best.attempt;
    report_.index = best.index;
  }

  void Fit() {
    FitOptions fit;
    fit.threads = request_.threads;
    fit.lambda_object = kLedByHand;
    std::vector<FrameReport> frames;
    Clip& clip = report_.clip;
    clip = FitTaken(report_.motion, hand_, prepared_.fit, fit, &frames,
                    [&](int done, int total) { return GoesOn("fit", done, total); });
    if (stopped_) return;
    clip.object->name = prepared_.object.name;
    clip.object->mesh = "object.ply";
    clip.action = "take";
    if (clip.betas.size() == 0 || clip.betas.isZero(0.0)) clip.body_model = start_.body->Name();
    SetTable(report_.table, clip);
  }

  void Measure() {
    const Clip& clip = report_.clip;
    const TakeTimes& times = report_.motion.times;
    std::vector<std::uint8_t> holding(static_cast<std::size_t>(clip.NumFrames()), 0);
    std::fill(holding.begin() + times.take, holding.end(), HoldingBit(request_.side));
    const std::array<const HandModel*, 1> hands{&hand_};
    report_.contact = ScoreContact(
        MeasureHands(clip, hands, holding, prepared_.solid, {.threads = request_.threads},
                     [&](int done, int total) { return GoesOn("metrics", done, total); }));
    if (stopped_) return;
    report_.measured = MeasureTake(clip, body_, request_.side, object_, report_.table, times.take,
                                   times.goals, report_.plan.places, request_.threads);
    MeasureWandering(body_, request_.side, report_);
  }

  TakeRequest request_;
  const TakeStart& start_;
  const PreparedObject& prepared_;
  const StagedProgress& progress_;
  TakeObject object_;
  HandModel hand_;
  BodySurface body_;
  bool stopped_ = false;
  TakeReport report_;
};

}  // namespace

TakeReport TakeFromTable(const TakeRequest& request, const TakeStart& start,
                         const PreparedObject& object, const BodyMotionMaker& motion,
                         const StagedProgress& progress) {
  return TakePipeline(request, start, object, progress).Run(motion);
}

double DeepestOver(const ContactScore& contact, int begin, int end) {
  double deepest = 0.0;
  for (int t = begin; t < end; ++t) deepest = std::max(deepest, contact.frames[t].penetration_mm);
  return deepest;
}

namespace {

using Eigen::Vector3d;

double Deepest(const Eigen::Matrix3Xd& points, const SideTable& table) {
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    deepest = std::max(deepest, -table.Distance(points.col(i)));
  }
  return 1000.0 * deepest;
}

// Maximum over all frames and its frame; -1 if all are 0.
void Greatest(const std::vector<double>& values, double& greatest, int& frame) {
  const auto at = std::ranges::max_element(values);
  if (at == values.end() || *at <= 0.0) return;
  greatest = *at;
  frame = static_cast<int>(at - values.begin());
}

}  // namespace

TakeMeasures MeasureTake(const Clip& clip, const BodySurface& surface, Side side,
                         const TakeObject& object, const SideTable& table, int take,
                         const std::vector<int>& goals, const std::vector<Vector3d>& places,
                         int threads) {
  const int count = clip.NumFrames();
  const std::vector<int>& hand = surface.Model().HandVertexIds(side);
  std::vector<double> object_depth(clip.pose.size()), hand_depth(clip.pose.size()),
      body_depth(clip.pose.size());
  TakeMeasures measures;
  measures.tilt_deg.assign(clip.pose.size(), 0.0);
  Eigen::Matrix3Xd bottom(3, count);
  ParallelFor(count, threads, [&](int t) {
    BodyState state;
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    const Eigen::Isometry3d object_pose = clip.object->Pose(t);
    body_depth[t] = Deepest(state.vertices, table);
    hand_depth[t] = Deepest(state.vertices(Eigen::all, hand), table);
    object_depth[t] = Deepest(object_pose * object.mesh.vertices, table);
    measures.tilt_deg[t] =
        std::acos(std::clamp(object_pose.linear()(2, 2), -1.0, 1.0)) * 180.0 / std::numbers::pi;
    bottom.col(t) = object_pose.linear() * object.BottomMiddle() + object_pose.translation();
  });
  Greatest(object_depth, measures.object_in_table_mm, measures.object_in_table_frame);
  Greatest(hand_depth, measures.hand_in_table_mm, measures.hand_in_table_frame);
  Greatest(body_depth, measures.body_in_table_mm, measures.body_in_table_frame);
  for (int t = 0; t < count; ++t) {
    if (t < take) {
      measures.moved_before_take_mm =
          std::max(measures.moved_before_take_mm,
                   1000.0 * (clip.object->trans.col(t) - clip.object->trans.col(0)).norm());
    } else {
      measures.max_tilt_deg = std::max(measures.max_tilt_deg, measures.tilt_deg[t]);
    }
    if (t == 0 || t + 1 == count) continue;
    const double acceleration =
        (bottom.col(t + 1) - 2.0 * bottom.col(t) + bottom.col(t - 1)).norm() * clip.frame_rate *
        clip.frame_rate;
    if (acceleration <= measures.max_acceleration) continue;
    measures.max_acceleration = acceleration;
    measures.max_acceleration_frame = t;
  }
  if (take > 0 && take < count) {
    measures.take_jump_mm =
        1000.0 * (clip.object->trans.col(take) - clip.object->trans.col(take - 1)).norm();
  }
  for (std::size_t g = 0; g < goals.size(); ++g) {
    measures.goal_m.push_back((bottom.col(goals[g]) - places[g + 1]).norm());
  }
  return measures;
}

Clip FitTaken(const TakeMotion& motion, const HandModel& hand, const FitObject& object,
              const FitOptions& options, std::vector<FrameReport>* frames,
              const std::function<bool(int, int)>& progress) {
  constexpr double kRate = 30.0;
  constexpr double kSettle_s = 0.3;
  const int take = motion.times.take, count = motion.clip.NumFrames();
  const Clip held = Slice(motion.clip, take, count);
  const HandModel* hands[] = {&hand};
  const std::vector<std::uint8_t> holding(held.pose.size(), HoldingBit(hand.HandSide()));
  FitResult fitted = FitClip(held, hands, object, holding, options, {}, progress);
  Clip clip = motion.clip;
  // Where the wrist's limits kept the hand off the grasp, the fit may place the object slightly
  // differently: it settles there from its standing pose.
  const Eigen::Matrix3d stands = ExpSO3(held.object->orient.col(0));
  const Vector3d settle = held.object->trans.col(0) - fitted.clip.object->trans.col(0);
  const Vector3d turn = LogSO3(stands * ExpSO3(fitted.clip.object->orient.col(0)).transpose());
  for (int t = 0; t < fitted.clip.NumFrames(); ++t) {
    clip.pose[take + t] = fitted.clip.pose[t];
    clip.trans.col(take + t) = fitted.clip.trans.col(t);
    const double left = 1.0 - MinimumJerk(t / (kSettle_s * kRate));
    const Eigen::Isometry3d pose = fitted.clip.object->Pose(t);
    clip.object->SetPose(take + t, RigidTransform(ExpSO3(left * turn) * pose.linear(),
                                                  pose.translation() + left * settle));
  }
  if (frames != nullptr) *frames = std::move(fitted.frames);
  return clip;
}

}  // namespace holdfast
